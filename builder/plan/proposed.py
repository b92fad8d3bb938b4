"""Scenes that a language model proposed, as a plan takes them from a file."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any


class ProposalError(ValueError):
    """A file that does not hold the proposals that a plan asks for."""


@dataclass(frozen=True)
class Proposed:
    """A scene that was accepted by ``mpmworlds propose``.

    Attributes
    ----------
    source
        File and line that it stands in.
    seeds
        Names of the seeds that the model saw.
    parent
        Name of the scene that was edited, such as ``p0012``; empty for a parent.
    edit
        How it was made, JSON.
    scene
        YAML.
    """

    source: str
    seeds: tuple[str, ...]
    parent: str
    edit: str
    scene: str

    @property
    def root(self) -> str:
        """Id of the seed or parent that was edited; empty for a parent."""
        return self.parent.partition("_")[0]  # a seed is named s06_slow_press


def read_proposals(path: Path, count: int | None = None) -> tuple[Proposed, ...]:
    """Read proposals in order.

    Parameters
    ----------
    path
        File of ``mpmworlds propose``.
    count
        How many of them; None for all.

    Returns
    -------
    tuple of Proposed
        The first so many.

    Raises
    ------
    ProposalError
        If the file is not there, is no such file, or has too few.
    """
    try:
        lines = path.read_text("utf-8").splitlines()[:count]
        found = [
            _proposed(f"{path}:{n}", json.loads(x)) for n, x in enumerate(lines, 1)
        ]
    except (OSError, ValueError) as error:
        raise ProposalError(f"proposals = {str(path)!r}: {error}") from None
    if count and len(found) < count:
        raise ProposalError(
            f"proposals = {str(path)!r} has {len(found)}, must have at least count = "
            f"{count}; lower it or propose more"
        )
    return tuple(found)


def _proposed(source: str, line: Any) -> Proposed:
    keys = "seeds", "parent", "edit", "scene"
    missing = [key for key in keys if not isinstance(line, dict) or key not in line]
    if missing:
        raise ValueError(f"{source}: has no {missing[0]!r}")
    edit = json.dumps(line["edit"], sort_keys=True)
    return Proposed(source, tuple(line["seeds"]), line["parent"], edit, line["scene"])
