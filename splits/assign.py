"""Which split a sample belongs to: a pure function of its id.

A draw belongs to an id and to nothing else, so samples can be added to the corpus, or
removed, without moving any other sample between splits.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.uniform import uniform

SPLITS = ("train", "modification_validation", "test")


@dataclass(frozen=True)
class SplitParams:
    """What the splits depend on besides the ids.

    Attributes
    ----------
    salt
        Text hashed with every id. Another salt is another division of the corpus.
    test_fraction
        Share of the parents that are held out with all their descendants. [1]
    modification_fraction
        Share of the children of training parents that are held out with their
        perturbations. [1]
    """

    salt: str
    test_fraction: float
    modification_fraction: float

    def __post_init__(self) -> None:
        if not isinstance(self.salt, str) or not self.salt or "\0" in self.salt:
            raise ValueError(
                f"split salt = {self.salt!r}, must be a non-empty text without NUL"
            )
        for name in ("test_fraction", "modification_fraction"):
            value = getattr(self, name)
            if not isinstance(value, int | float) or not 0.0 <= value < 1.0:
                raise ValueError(f"split {name} = {value!r}, must be in [0, 1)")


_draw: Final = lru_cache(1024)(uniform)  # a template has many perturbations


def split_of(sample_id: str, params: SplitParams) -> str:
    """Return the split of one sample.

    `test` takes whole families: a parent and all that was made from it.
    `modification_validation` takes some children of the training parents, with their
    perturbations: the parent has been seen, the modification has not. `train` takes the
    rest, and every family of a hand-made seed.

    Parameters
    ----------
    sample_id
        Id such as `p0123`, `p0123-c4`, `p0123-c4-n07` or `p0123-n07`.
    params
        Salt and fractions.

    Returns
    -------
    str
        A member of `SPLITS`.

    Raises
    ------
    SampleIdError
        If the id does not follow the grammar.
    """
    sample = SampleId.parse(sample_id)
    if not sample.is_of_seed_family:
        if _draw(params.salt, "test", sample.family) <= params.test_fraction:
            return "test"
    if sample.child is not None:
        draw = _draw(params.salt, "modification", sample.template)
        if draw <= params.modification_fraction:
            return "modification_validation"
    return "train"


def assign(ids: Iterable[str], params: SplitParams) -> dict[str, list[str]]:
    """Return the sorted ids of every split.

    Parameters
    ----------
    ids
        Sample ids, in any order.
    params
        Salt and fractions.

    Returns
    -------
    dict
        Split name -> sorted ids, for every member of `SPLITS`, empty ones too.

    Raises
    ------
    ValueError
        If an id does not follow the grammar or occurs twice.
    """
    lists: dict[str, list[str]] = {split: [] for split in SPLITS}
    seen = set()
    for sample_id in ids:
        if sample_id in seen:
            raise ValueError(f"sample id {sample_id!r}: occurs twice, must be unique")
        seen.add(sample_id)
        lists[split_of(sample_id, params)].append(sample_id)
    return {split: sorted(members) for split, members in lists.items()}
