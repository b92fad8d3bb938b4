"""The samples that search is developed on: chosen by a rule, never of a test split."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from mpmworlds.loaders.load import Example, Examples, load
from mpmworlds.loaders.regimes import DEFAULT

CHOSEN: Final[Mapping[str, slice]] = {
    # The first ones were looked at while search was written.
    "modification_validation": slice(1, None, 2),
    "train": slice(4, None, 10),
}
"""Split -> which rows of `mini`, in the order of their ids."""
SPLITS: Final = tuple(CHOSEN)
FINAL: Final = ("test", "modification_validation")
"""Splits that are measured as a whole, once nothing is changed any more."""


def chosen_ids(release: Path, split: str, config: str) -> list[str]:
    """Ids of the development samples of a split."""
    ids: Sequence[str] = load(release, split, config).table["id"]
    return sorted(ids)[CHOSEN[split]]


def all_ids(release: Path, split: str, config: str) -> list[str]:
    """Ids of all samples of a split, for a measurement at the end."""
    ids: Sequence[str] = load(release, split, config).table["id"]
    return sorted(ids)


def examples(
    release: Path,
    split: str,
    config: str,
    ids: Sequence[str],
    regime: str = DEFAULT,
    *,
    final: bool = False,
) -> list[Example]:
    """Samples of a split, those of some ids if there are any.

    Raises
    ------
    ValueError
        If it is a split that nothing is developed on, unless it is `final`.
    """
    if split not in (FINAL if final else SPLITS):
        raise ValueError(
            f"split {split!r}: search is developed on {' and '.join(SPLITS)} alone"
        )
    all_: Examples = load(release, split, config, regime)
    places = {name: k for k, name in enumerate(all_.table["id"])}
    return [all_[places[name]] for name in ids or sorted(places)]
