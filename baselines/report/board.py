"""Systems side by side: those of one split, over the same samples."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from mpmworlds.baselines.results import SUMMARY
from mpmworlds.baselines.system import (
    ComparisonError,
    System,
    hold_to_same_samples,
    hold_together,
)
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.metrics.reduction import FRAMERATE


@dataclass(frozen=True)
class Split:
    """What a release tells of a split."""

    ids: Sequence[str]
    """Its samples."""
    framerate: int
    """Frames per second of its clips, as they are evaluated [1/s]."""


Splits: TypeAlias = Mapping[tuple[str, str], Split]
"""Configuration and split -> what the release tells of it."""


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
    """Samples of the split; without a release: as many as any system has or its
    summary expects."""
    framerate: int = FRAMERATE
    """Frames per second of its clips [1/s]; without a release: that of metrics."""

    @property
    def name(self) -> str:
        """Configuration and split."""
        return f"{self.config}/{self.split}"

    @property
    def samples(self) -> list[str]:
        """Samples that are compared, sorted."""
        return list(self.systems[0].samples)

    def complete(self, system: System) -> bool:
        """Whether there are results of all samples of the split."""
        troubled = system.told is not None and bool(system.told.troubles)
        return self.evaluated[system.label] == self.expected and not troubled

    @cached_property
    def warnings(self) -> list[str]:
        """What is missing of the evaluations, a line for each that lacks something."""
        return [text for text in map(self._lacking, self.systems) if text]

    def _lacking(self, system: System) -> str:
        start = f"{system.label} on {system.provenance.split}"
        if self.complete(system):
            untold = (
                f"{start}: no {SUMMARY} beside its results, so that its evaluation may "
                "not have ended."
            )
            return untold if system.told is None else ""
        text = (
            f"{start}: INCOMPLETE, results of {self.evaluated[system.label]} of "
            f"{self.expected} samples"
        )
        troubles = sorted((system.told.troubles if system.told else {}).items())
        if not troubles:
            return f"{text}."
        sample, reason = troubles[0]
        more = f" and {len(troubles) - 1} more" if troubles[1:] else ""
        return f"{text}; nothing can be said of {sample}{more}: {reason.rstrip('.')}."

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
    complete: bool
    """Whether there is a result of every sample."""
    valid: int
    """Those that are compared whose chosen candidate was scored."""
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
        complete=board.complete(system),
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
    systems: Sequence[System], splits: Splits | None = None, *, common: bool = False
) -> list[Board]:
    """Divide systems by configuration and split.

    Parameters
    ----------
    systems
        What to compare.
    splits
        The splits, where a release tells of them.
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
        _board(key, list(group.values()), (splits or {}).get(key), common)
        for key, group in sorted(groups.items())
    ]


def _board(
    key: tuple[str, str],
    systems: Sequence[System],
    split: Split | None,
    common: bool,
) -> Board:
    found = set[str]().union(*(system.samples for system in systems))
    known = found if split is None else set(split.ids)
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
        hold_to_same_samples(systems, "; ".join([*_unfinished(systems), remedy]))
        _hold_to_list(systems[0], known)
        compared = list(systems)
    evaluated = {system.label: len(system.samples) for system in systems}
    expected = max([len(known), *(s.told.expected for s in systems if s.told)])
    framerate = split.framerate if split else FRAMERATE
    return Board(*key, tuple(compared), evaluated, expected, framerate)


def _unfinished(systems: Iterable[System]) -> list[str]:
    """Those that are incomplete by their own summaries, for a message."""
    return [
        f"{system.folder} is incomplete: {system.told.samples} of "
        f"{system.told.expected} samples"
        for system in systems
        if system.told is not None and system.told.samples < system.told.expected
    ]


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
        else "they differ in options or source: name them apart, NAME=FOLDER"
    )
    return f"{first.folder} and {second.folder}: both are {second.label}; {remedy}"
