"""Systems side by side: those of one split, over the same samples."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from mpmworlds.baselines.system import (
    ComparisonError,
    System,
    hold_to_same_samples,
    hold_together,
)
from mpmworlds.loaders.regimes import REGIMES

Lists: TypeAlias = Mapping[tuple[str, str], Sequence[str]]
"""Configuration and split -> ids of its samples in the release."""


@dataclass(frozen=True, eq=False)
class Board:
    """The systems of one split of one configuration."""

    config: str
    """Configuration of the release."""
    split: str
    """Split of it."""
    systems: tuple[System, ...]
    """By name, then by regime; all have the same samples."""
    evaluated: Mapping[str, int]
    """Label -> samples in the results, more than are compared if only common ones
    are."""
    expected: int
    """Samples of the split; without a release: those that any system has."""

    @property
    def name(self) -> str:
        """Configuration and split."""
        return f"{self.config}/{self.split}"

    @property
    def samples(self) -> list[str]:
        """Samples that are compared, sorted."""
        return list(self.systems[0].samples)

    @cached_property
    def ceilings(self) -> dict[str, dict[str, float]]:
        """Noise ceiling of each sample that has one."""
        return {
            sample: candidates[0].ceiling
            for sample, candidates in self.systems[0].samples.items()
            if candidates[0].ceiling is not None
        }


@dataclass(frozen=True)
class Coverage:
    """On how many samples a system gave what can be scored, and how it failed."""

    evaluated: int
    """Samples with a result."""
    expected: int
    """Samples of the split."""
    compared: int
    """Samples that the numbers are of."""
    valid: int
    """Those of them whose chosen candidate was scored."""
    failures: Mapping[str, int]
    """Outcome -> samples that failed so."""


def coverage(board: Board, system: System, metric: str) -> Coverage:
    """Coverage of the candidates that a metric chooses."""
    outcomes = Counter(row.outcome for row in system.rows(metric))
    valid = outcomes.pop("ok", 0)
    return Coverage(
        evaluated=board.evaluated[system.label],
        expected=board.expected,
        compared=len(system.samples),
        valid=valid,
        failures=dict(sorted(outcomes.items())),
    )


def read_systems(named: Iterable[str]) -> list[System]:
    """Read folders of results, each `FOLDER` or `NAME=FOLDER`.

    Raises
    ------
    ValueError
        If a folder holds no whole results, or they are of different releases or
        metrics.
    """
    systems = []
    for text in named:
        name, separator, folder = text.partition("=")
        if not separator or Path(text).exists():
            name, folder = "", text
        systems.append(System.read(Path(folder), name))
    hold_together(systems)
    return systems


def boards(
    systems: Sequence[System], lists: Lists | None = None, *, common: bool = False
) -> list[Board]:
    """Divide systems by configuration and split.

    Parameters
    ----------
    systems
        What to compare.
    lists
        Samples of the splits, where a release tells them.
    common
        Compare over the samples that all systems of a split have, instead of asking
        for the same samples.

    Returns
    -------
    list of Board
        Sorted by configuration and split.

    Raises
    ------
    ComparisonError
        If a system is there twice, or samples differ, or none is left.
    """
    groups: dict[tuple[str, str], dict[str, System]] = {}
    for system in sorted(systems, key=_order):
        origin = system.provenance
        group = groups.setdefault((origin.config, origin.split), {})
        if system.label in group:
            raise ComparisonError(_twice(group[system.label], system))
        group[system.label] = system
    return [
        _board(key, list(group.values()), (lists or {}).get(key), common)
        for key, group in sorted(groups.items())
    ]


def _board(
    key: tuple[str, str],
    systems: Sequence[System],
    listed: Sequence[str] | None,
    common: bool,
) -> Board:
    found = set[str]().union(*(system.samples for system in systems))
    known = found if listed is None else set(listed)
    if found - known:
        raise ComparisonError(
            f"{'/'.join(key)}: results have {min(found - known)}, which is no "
            "sample of it in the release; name the release that they are of"
        )
    if common:
        shared = sorted(found.intersection(*(system.samples for system in systems)))
        if not shared:
            raise ComparisonError(
                f"{'/'.join(key)}: no sample is common to all systems; leave some out"
            )
        compared = [system.only(shared) for system in systems]
    else:
        remedy = "evaluate both on the same, or compare the common ones with --common"
        hold_to_same_samples(systems, remedy)
        _hold_to_list(systems[0], known)
        compared = list(systems)
    evaluated = {system.label: len(system.samples) for system in systems}
    return Board(*key, tuple(compared), evaluated, len(known))


def _hold_to_list(system: System, known: set[str]) -> None:
    absent = sorted(known - system.samples.keys())
    if absent:
        raise ComparisonError(
            f"{system.folder}: incomplete: {len(system.samples)} of {len(known)} "
            f"samples of the split, {absent[0]} is missing; evaluate again to go on, "
            "or compare what is there with --common"
        )


def _order(system: System) -> tuple[str, int, str]:
    names, regime = list(REGIMES), system.provenance.regime
    place = names.index(regime) if regime in names else len(names)
    return system.name, place, regime


def _twice(first: System, second: System) -> str:
    same = first.provenance.predictor_sha256 == second.provenance.predictor_sha256
    remedy = (
        "name one of them"
        if same
        else "they differ in their options: name them apart, NAME=FOLDER"
    )
    return f"{first.folder} and {second.folder}: both are {second.label}; {remedy}"
