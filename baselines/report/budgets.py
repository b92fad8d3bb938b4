"""What a predictor that is told how long to think makes of more time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from mpmworlds.baselines.report.numbers import Entry
from mpmworlds.metrics import METRICS, Interval

BUDGET: Final = "minutes"
"""Option of a predictor that says how long it may take for a sample, of one core."""


@dataclass(frozen=True, eq=False)
class Spending:
    """A metric at each of the budgets that a predictor was run with."""

    predictor: str
    """Name of the predictor."""
    regime: str
    """What it was told besides the prefix."""
    labels: tuple[str, ...]
    """Labels of the systems, one of each budget."""
    metric: str
    """Which metric."""
    minutes: tuple[float, ...]
    """Budgets of a sample, growing [min of one core]."""
    values: tuple[Interval, ...]
    """Mean over all samples at each, a failure at the worst value."""


def spendings(found: Sequence[Entry]) -> list[Spending]:
    """Every metric of whatever was run with several budgets, else alike."""
    groups: dict[tuple[str, str], dict[float, list[Entry]]] = {}
    for entry in found:
        origin = entry.system.provenance
        minutes = origin.options.get(BUDGET)
        if isinstance(minutes, int | float) and entry.metric.name in METRICS:
            group = groups.setdefault((origin.predictor, origin.regime), {})
            group.setdefault(float(minutes), []).append(entry)
    return [
        _spending(predictor, regime, group, metric)
        for (predictor, regime), group in sorted(groups.items())
        if len(group) > 1
        for metric in METRICS
    ]


def _spending(
    predictor: str, regime: str, group: dict[float, list[Entry]], metric: str
) -> Spending:
    chosen = {  # the first of several that differ in something else
        minutes: next(e for e in group[minutes] if e.metric.name == metric)
        for minutes in sorted(group)
    }
    return Spending(
        predictor=predictor,
        regime=regime,
        labels=tuple(entry.system.label for entry in chosen.values()),
        metric=metric,
        minutes=tuple(chosen),
        values=tuple(entry.raw.failures_at_worst for entry in chosen.values()),
    )
