"""The numbers of a report: three summaries of every system and metric."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from mpmworlds.baselines.report.board import Board, Coverage, coverage
from mpmworlds.baselines.system import System
from mpmworlds.metrics import (
    SCORED,
    Interval,
    Metric,
    Row,
    Summary,
    summarise,
)
from mpmworlds.metrics.aggregate import bootstrap

KINDS: Final = MappingProxyType(
    {
        "valid": "valid only",
        "failures_at_worst": "failures at worst",
        "paired": "paired",
    }
)
"""Summary -> what a table calls it."""
SCALES: Final = MappingProxyType({"raw": "raw", "beyond": "beyond the noise ceiling"})
"""Scale of a value -> what a table calls it. Beyond the ceiling, 0 is as good as a
re-simulation, and more is worse by so much, whatever the direction of the metric."""


@dataclass(frozen=True, eq=False)
class Entry:
    """What one system came to in one metric."""

    system: System
    """Which system."""
    metric: Metric
    """Which metric."""
    coverage: Coverage
    """On how many samples."""
    raw: Summary
    """Values of the metric."""
    beyond: Summary | None
    """How much worse than the noise ceiling; None if no sample has one."""

    def summary(self, scale: str) -> Summary | None:
        """Summary on one of the `SCALES`."""
        return self.raw if scale == "raw" else self.beyond


def entries(board: Board) -> list[Entry]:
    """Every metric of every system of a board, by metric."""
    return [entry for metric in SCORED for entry in _entries(board, metric)]


def _entries(board: Board, metric: str) -> Iterator[Entry]:
    rows = {system.label: system.rows(metric) for system in board.systems}
    raw = summarise([row for some in rows.values() for row in some], metric)
    shared = set.intersection(
        *({r.sample_id for r in some if r.scores is not None} for some in rows.values())
    )
    for system in board.systems:
        yield Entry(
            system=system,
            metric=SCORED[metric],
            coverage=coverage(board, system, metric),
            raw=raw[system.label],
            beyond=_beyond(board, rows[system.label], shared, SCORED[metric]),
        )


def _beyond(
    board: Board, rows: Sequence[Row], shared: set[str], metric: Metric
) -> Summary | None:
    """Summaries of |value - best| - |ceiling - best|, where there is a ceiling."""
    known = {
        sample: abs(ceiling[metric.name] - metric.best)
        for sample, ceiling in board.ceilings.items()
        if metric.name in ceiling
    }
    if not known:
        return None
    kept = [row for row in rows if row.sample_id in known]
    losses = [
        abs(row.value(metric.name) - metric.best) - known[row.sample_id] for row in kept
    ]
    valid = [row.scores is not None for row in kept]
    paired = [row.sample_id in shared for row in kept]
    families = [row.family_id for row in kept]
    return Summary(
        valid=interval(families, losses, valid),
        failures_at_worst=interval(families, losses, [True] * len(kept)),
        paired=interval(families, losses, paired),
    )


def interval(
    families: Sequence[str], values: Sequence[float], kept: Sequence[bool]
) -> Interval:
    """Mean of some values and how sure it is, families resampled whole."""
    numbers = np.array([v for v, keep in zip(values, kept, strict=True) if keep])
    of = [family for family, keep in zip(families, kept, strict=True) if keep]
    n = len(numbers)
    low, high = bootstrap(of, numbers[:, None], lambda means: means[:, 0], seed=0)
    return Interval(
        mean=float(numbers.mean()) if n else None,
        sem=float(numbers.std(ddof=1) / math.sqrt(n)) if n > 1 else None,
        n=n,
        families=len(set(of)),
        low=low,
        high=high,
    )


def merged_rows(system: System) -> list[Row]:
    """A row for each sample with the score of each metric's own choice.

    With several candidates each metric scores another one, so that no single candidate
    has all the reported scores. A metric whose choice failed has its worst value; a
    sample on which all failed is a failure.
    """
    by_metric = {metric: system.chosen(metric) for metric in SCORED}
    rows = []
    for sample in system.samples:
        picked = {metric: by_metric[metric][sample] for metric in SCORED}
        first = next(iter(picked.values()))
        valid = any(result.continuation is not None for result in picked.values())
        scores = {m: result.row("").value(m) for m, result in picked.items()}
        rows.append(
            Row(
                sample_id=sample,
                family_id=first.family_id,
                system=system.label,
                candidate=first.candidate,
                outcome="ok" if valid else first.outcome,
                scores=scores if valid else None,
            )
        )
    return rows
