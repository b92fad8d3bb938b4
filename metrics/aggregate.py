"""From rows to reported numbers: three summaries, intervals, normalised scores."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mpmworlds.metrics.constants import CONSTANTS
from mpmworlds.metrics.registry import metric_named

VALID: Final = "ok"
"""Outcome of a candidate whose clip was scored; any other outcome is a failure."""


@dataclass(frozen=True)
class Row:
    """What one candidate of one system came to on one sample.

    Raises
    ------
    ValueError
        If a valid row has no scores, a failed one has some, or a score is not finite.
    """

    sample_id: str
    """Evaluated sample."""
    family_id: str
    """Root parent of the sample: samples of one family are not independent."""
    system: str
    """What produced the candidate."""
    candidate: int
    """Number of the candidate, 0 to N - 1."""
    outcome: str
    """``"ok"``, or the reason of the failure."""
    scores: Mapping[str, float] | None
    """Metric values of a valid candidate, None for a failed one."""

    def __post_init__(self) -> None:
        """Hold outcome and scores to each other."""
        subject = f"{self.system} on {self.sample_id}, candidate {self.candidate}"
        if (self.outcome == VALID) != (self.scores is not None):
            raise ValueError(
                f"{subject}: outcome {self.outcome!r} with scores {self.scores}, must "
                f"have scores exactly when it is {VALID!r}; a failure has none"
            )
        for name, value in (self.scores or {}).items():
            if not math.isfinite(value):
                raise ValueError(
                    f"{subject}: {name} = {value}, must be finite; record a failed "
                    "candidate by its outcome, without scores"
                )

    def value(self, metric: str) -> float:
        """Return the score of a valid row, the metric's worst value of a failed one.

        Parameters
        ----------
        metric : str
            Name of a metric that `score` reports.

        Raises
        ------
        ValueError
            If the metric is unknown, or if a valid row lacks it.
        """
        worst = metric_named(metric).worst
        if self.scores is None:
            return worst
        if metric not in self.scores:
            raise ValueError(
                f"{self.system} on {self.sample_id}, candidate {self.candidate}: no "
                f"{metric}, must be among its scores {sorted(self.scores)}; score the "
                "candidate again"
            )
        return self.scores[metric]


@dataclass(frozen=True)
class Interval:
    """One reported number: a mean and how sure it is; None where undefined."""

    mean: float | None
    """Mean over samples; None without samples."""
    sem: float | None
    """Standard error of the mean, of independent samples; None below 2 samples."""
    n: int
    """Number of samples."""
    families: int
    """Number of families among them."""
    low: float | None
    """Lower end of the 95 % bootstrap interval; None below 10 families."""
    high: float | None
    """Upper end of the 95 % bootstrap interval; None below 10 families."""


@dataclass(frozen=True)
class Summary:
    """The three summaries of one system and metric, always shown together."""

    valid: Interval
    """Over the valid samples only (the paper's)."""
    failures_at_worst: Interval
    """Over all samples, a failure scoring the metric's worst value."""
    paired: Interval
    """Over the samples on which all compared systems are valid."""


def _interval(values: Sequence[tuple[str, float]], seed: int) -> Interval:
    """Summarise (family, value) pairs; families are resampled whole."""
    numbers = np.array([value for _, value in values], dtype=np.float64)
    names = sorted({family for family, _ in values})
    n = numbers.size
    mean = float(numbers.mean()) if n else None
    sem = float(numbers.std(ddof=1) / math.sqrt(n)) if n > 1 else None
    if len(names) < CONSTANTS.bootstrap_min_families:
        return Interval(mean, sem, n, len(names), None, None)
    number = {name: k for k, name in enumerate(names)}
    family = np.array([number[name] for name, _ in values])
    sums = np.bincount(family, weights=numbers)
    counts = np.bincount(family)
    random = np.random.Generator(np.random.Philox(seed))
    draws = random.integers(
        len(names), size=(CONSTANTS.bootstrap_resamples, len(names))
    )
    means = sums[draws].sum(axis=1) / counts[draws].sum(axis=1)
    tail = (1 - CONSTANTS.bootstrap_confidence) / 2
    low, high = np.quantile(means, [tail, 1 - tail])
    return Interval(mean, sem, n, len(names), float(low), float(high))


def _by_sample(rows: Iterable[Row]) -> dict[str, dict[str, Row]]:
    """Index rows by system and sample, both sorted; one row each."""
    table: dict[str, dict[str, Row]] = {}
    for row in sorted(rows, key=lambda r: (r.system, r.sample_id)):
        samples = table.setdefault(row.system, {})
        if row.sample_id in samples:
            raise ValueError(
                f"{row.system} on {row.sample_id}: several rows, must be one per "
                "system and sample; select a candidate first (best_of_n)"
            )
        samples[row.sample_id] = row
    return table


def summarise(rows: Iterable[Row], metric: str, seed: int = 0) -> dict[str, Summary]:
    """Summarise one metric over samples, for each of the compared systems.

    Parameters
    ----------
    rows : iterable of Row
        One row per system and sample, failures included, of all compared systems.
    metric : str
        Name of a metric that `score` reports.
    seed : int
        Seed of the bootstrap (numpy Philox); equal seeds give equal intervals.

    Returns
    -------
    dict of str to Summary
        One per system, sorted by name; the order of the rows does not matter.

    Raises
    ------
    ValueError
        If the metric is unknown or missing in a valid row, or if a system has several
        rows for one sample.

    Notes
    -----
    The interval is the percentile bootstrap of the mean over samples, 10 000 resamples
    of whole families with replacement [Davison and Hinkley 1997, sec. 3.8]. Of few
    families it covers too little (5: 82 % instead of 95), so that there is none below
    10.
    """
    metric_named(metric)
    table = _by_sample(rows)
    valid = {
        system: {s for s, row in samples.items() if row.scores is not None}
        for system, samples in table.items()
    }
    shared = set.intersection(*valid.values()) if valid else set()
    summaries = {}
    for system, samples in table.items():
        values = {s: (row.family_id, row.value(metric)) for s, row in samples.items()}
        summaries[system] = Summary(
            valid=_interval([values[s] for s in samples if s in valid[system]], seed),
            failures_at_worst=_interval([*values.values()], seed),
            paired=_interval([values[s] for s in samples if s in shared], seed),
        )
    return summaries


def normalised_scores(
    means: Mapping[str, Mapping[str, float]],
) -> dict[str, float]:
    """Compute one comparable number per table row.

    Parameters
    ----------
    means : mapping of str to (mapping of str to float)
        For each row shown (a model and regime), its mean per metric; the same metrics
        in every row.

    Returns
    -------
    dict of str to float
        In [0, 1], up is good: each metric is min-max scaled over the rows, flipped
        where down is better, and averaged. A metric on which all rows tie gives 0.5
        to each, so it changes no order.

    Raises
    ------
    ValueError
        If a metric is unknown, there is none, or the rows differ in their metrics.
    """
    names = sorted({name for row in means.values() for name in row})
    for label, row in means.items():
        if not names or sorted(row) != names:
            raise ValueError(
                f"row {label!r}: metrics {sorted(row)}, must be those of all rows, "
                f"{names}, and at least one; leave out rows or metrics without a value"
            )
    totals = dict.fromkeys(means, 0.0)
    for name in names:
        column = [row[name] for row in means.values()]
        low, high = min(column), max(column)
        for label, value in zip(means, column, strict=True):
            share = (value - low) / (high - low) if high > low else 0.5
            up = metric_named(name).direction == "up"
            totals[label] += share if up else 1 - share
    return {label: total / len(names) for label, total in totals.items()}
