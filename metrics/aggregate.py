"""From rows to reported numbers: three summaries, with intervals."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.constants import CONSTANTS
from mpmworlds.metrics.registry import metric_named

Columns = npt.NDArray[np.float64]
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
    families = [family for family, _ in values]
    n, different = numbers.size, len(set(families))
    mean = float(numbers.mean()) if n else None
    sem = float(numbers.std(ddof=1) / math.sqrt(n)) if n > 1 else None
    low, high = bootstrap(families, numbers[:, None], lambda means: means[:, 0], seed)
    return Interval(mean, sem, n, different, low, high)


def bootstrap(
    families: Sequence[str],
    values: Columns,
    score: Callable[[Columns], Columns],
    seed: int,
) -> tuple[float | None, float | None]:
    """Ends of the percentile interval of a score of means, families resampled whole.

    Parameters
    ----------
    families : sequence of str, length n
        Family of each sample.
    values : float64 array, shape (n, K)
        K numbers of each sample.
    score : callable
        From means (R, K) of R resamples to their scores (R,).
    seed : int
        Seed of the resamples (numpy Philox).

    Returns
    -------
    pair of float, or of None
        Lower and upper end; None of too few families.
    """
    names = sorted(set(families))
    if len(names) < CONSTANTS.bootstrap_min_families:
        return None, None
    number = {name: k for k, name in enumerate(names)}
    family = np.array([number[name] for name in families])
    sums = np.zeros((len(names), values.shape[1]))
    np.add.at(sums, family, values)
    counts = np.bincount(family)
    random = np.random.Generator(np.random.Philox(seed))
    shape = CONSTANTS.bootstrap_resamples, len(names)
    draws = random.integers(len(names), size=shape)
    means = sums[draws].sum(axis=1) / counts[draws].sum(axis=1)[:, None]
    tail = (1 - CONSTANTS.bootstrap_confidence) / 2
    low, high = np.quantile(score(means), [tail, 1 - tail])
    return float(low), float(high)


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
