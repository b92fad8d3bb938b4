"""The numbers behind the figures: over time, by material family, by regime."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.report.board import Board
from mpmworlds.baselines.report.numbers import Entry, interval
from mpmworlds.baselines.results import Result
from mpmworlds.baselines.slices import parts
from mpmworlds.baselines.system import System
from mpmworlds.metrics import METRICS, SCORED, Interval, collapsed_share
from mpmworlds.metrics import normalised_scores as normalise
from mpmworlds.metrics.reduction import prefix_length

CURVED: Final = MappingProxyType(
    {m.name: m for m in {m.curve: m for m in SCORED.values()}.values()}
)
"""Metrics whose curves are shown. Of two that have the same curve it is the later one,
the amount: whether it exceeds a threshold says nothing at a time."""
TOLD, UNTOLD = "full_config", "no_materials"
AVERAGE: Final = "average"
"""In the place of a metric: the mean over the paper's seven."""
COLLAPSED: Final = "collapsed share"
"""In the place of a metric: samples that have lost half a body by then."""


@dataclass(frozen=True, eq=False)
class Line:
    """A mean over samples at each time."""

    system: System
    """Which system."""
    metric: str
    """Which metric, or `COLLAPSED`."""
    seconds: npt.NDArray[np.float64]
    """Time in the video [s], shape (T,); the prefix is before it."""
    mean: npt.NDArray[np.float64]
    """Mean over the valid samples, shape (T,)."""
    sem: npt.NDArray[np.float64]
    """Its standard error, shape (T,); 0 of a single sample."""
    n: int
    """Valid samples."""


@dataclass(frozen=True, eq=False)
class Point:
    """A mean over the samples with a material family."""

    system: System
    """Which system."""
    family: str
    """Which family of materials."""
    metric: str
    """Which metric, or `AVERAGE`."""
    value: Interval
    """The mean and how sure it is."""


def lines(board: Board) -> list[Line]:
    """Curves of every metric of every system over the continuation, valid samples only.

    Raises
    ------
    ValueError
        If the clips of a split are of different lengths.
    """
    found = []
    for system in board.systems:
        for metric in SCORED:
            curves = [
                result.curves[metric]
                for result in system.chosen(metric).values()
                if result.curves is not None
            ]
            if not curves:
                continue
            values = np.array(_equally_long(system, metric, curves))
            seconds = _seconds(system, values.shape[1], board.framerate)
            found.append(_line(system, metric, seconds, values))
            if metric == "collapse":
                share = collapsed_share(list(values))
                sem = np.sqrt(share * (1 - share) / len(values))
                found.append(Line(system, COLLAPSED, seconds, share, sem, len(values)))
    return found


def normalised(board: Board, found: Sequence[Entry]) -> dict[str, float]:
    """Normalised score of each system with a valid sample, as in the paper's figure."""
    means: dict[str, dict[str, float]] = {}
    for entry in found:
        mean = entry.raw.valid.mean
        if entry.metric.name in METRICS and mean is not None:
            means.setdefault(entry.system.label, {})[entry.metric.name] = mean
    whole = {label: row for label, row in means.items() if len(row) == len(METRICS)}
    return normalise(whole) if whole else {}


def by_family(board: Board) -> list[Point]:
    """Every metric of every system on each material family, valid samples only."""
    found = []
    for system in board.systems:
        for metric in METRICS:
            chosen = system.chosen(metric).values()
            for family, members in parts(chosen)["material_family"].items():
                values = [_value(result, metric) for result in members]
                told = [v for v in values if v is not None]
                value = interval(
                    [r.family_id for r in members if r.continuation is not None],
                    told,
                    [True] * len(told),
                )
                found.append(Point(system, family, metric, value))
    return found


def sensitivity(board: Board) -> list[Point]:
    """What a system gains from not being told the materials; a loss is below 0.

    Of each material family, metric, and of the average of the metrics: the mean of
    `|full - best| - |without - best|` over the samples that are valid in both regimes.
    The system of each point is the one that is not told.
    """
    found = []
    for untold in board.systems:
        for told in board.systems:
            pair = told.provenance.regime, untold.provenance.regime
            if told.name == untold.name and pair == (TOLD, UNTOLD):
                found += _changes(told, untold)
    return found


def _changes(told: System, untold: System) -> list[Point]:
    gains: dict[str, dict[str, float]] = {}  # metric -> sample -> gain
    for metric in METRICS:
        best, full = METRICS[metric].best, told.chosen(metric)
        for sample, result in untold.chosen(metric).items():
            before, after = _value(full[sample], metric), _value(result, metric)
            if before is not None and after is not None:
                gain = abs(before - best) - abs(after - best)
                gains.setdefault(metric, {})[sample] = gain
    shared = set.intersection(*map(set, gains.values())) if gains else set()
    gains[AVERAGE] = {
        sample: float(np.mean([gains[metric][sample] for metric in METRICS]))
        for sample in sorted(shared)
    }
    first = [candidates[0] for candidates in untold.samples.values()]
    return [
        Point(untold, family, metric, _of(gains.get(metric, {}), members))
        for metric in (*METRICS, AVERAGE)
        for family, members in parts(first)["material_family"].items()
    ]


def _of(values: dict[str, float], members: Sequence[Result]) -> Interval:
    kept = [result for result in members if result.sample_id in values]
    return interval(
        [result.family_id for result in kept],
        [values[result.sample_id] for result in kept],
        [True] * len(kept),
    )


def _value(result: Result, metric: str) -> float | None:
    return None if result.continuation is None else result.row("").value(metric)


def _equally_long(
    system: System, metric: str, curves: list[list[float]]
) -> list[list[float]]:
    lengths = sorted({len(curve) for curve in curves})
    if len(lengths) > 1:
        raise ValueError(
            f"{system.folder}: curves of {metric} have {lengths[0]} to {lengths[-1]} "
            "values, must be as many for all samples of a split"
        )
    return curves


def _seconds(system: System, count: int, framerate: int) -> npt.NDArray[np.float64]:
    """Times of a curve, whose last value belongs to the last frame."""
    frames = max(
        len(curve)
        for result in system.results
        for curve in (result.curves or {}).values()
    )
    first = prefix_length(framerate) + frames - count
    return (first + np.arange(count)) / framerate


def _line(
    system: System,
    metric: str,
    seconds: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
) -> Line:
    n = len(values)
    sem = values.std(axis=0, ddof=1) / np.sqrt(n) if n > 1 else np.zeros(len(seconds))
    return Line(system, metric, seconds, values.mean(axis=0), sem, n)
