"""What an audit reads of a corpus, and what it finds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple


class Record(NamedTuple):
    """What an audit reads of a sample: columns of a manifest, by their names."""

    id: str
    kind: str
    parent_id: str
    family_id: str
    seeds: Sequence[str]
    split: str
    scene: str
    scene_sha256: str
    program_sha256: str


@dataclass(frozen=True)
class Finding:
    """Something wrong with samples.

    Attributes
    ----------
    rule
        Short name of the rule that is broken.
    ids
        The samples it is about; one of each split, where many are alike.
    detail
        What was found and what must be.
    distance
        How far apart two scenes are, for the rules about near ones. [1]
    """

    rule: str
    ids: tuple[str, ...]
    detail: str
    distance: float | None = None

    def __str__(self) -> str:
        """Return it as a line of text."""
        return f"{', '.join(self.ids)}: {self.rule}: {self.detail}"
