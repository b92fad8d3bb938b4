"""One number per system: anchored scores for rankings, normalised ones for a figure."""

from collections.abc import Iterable, Mapping

import numpy as np

from mpmworlds.metrics.aggregate import Columns, Interval, Row, bootstrap
from mpmworlds.metrics.registry import SCORED, metric_named

LEAST, MOST = -1.0, 2.0
"""Bounds of what one metric adds: else one in which copy_last and the ceiling hardly
differ would decide alone."""


def anchored_score(
    rows: Iterable[Row],
    copy_last: Iterable[Row],
    ceilings: Mapping[str, Mapping[str, float]],
    seed: int = 0,
) -> Interval:
    """Compute how far a system gets from copying the last frame to the noise ceiling.

    Parameters
    ----------
    rows : iterable of Row
        One row per sample of a system; a failure scores each metric's worst value.
    copy_last : iterable of Row
        Those of the predictor that repeats the last frame of the prefix.
    ceilings : mapping of str to (mapping of str to float)
        Noise ceiling of each metric for each sample.
    seed : int
        Seed of the bootstrap, in which samples, anchors and all, are resampled by
        family.

    Returns
    -------
    Interval
        The score and its interval, without a standard error: 0 is copy_last, 1 the
        ceiling, more is better than that.

    Raises
    ------
    ValueError
        If the samples of the three differ, or there is none.

    Notes
    -----
    With L the mean distance of a metric from its best value, a metric adds
    `(L_copy - L) / (L_copy - L_ceiling)`, and the score is the mean over the metrics on
    which copy_last is worse than the ceiling. On the others (it loses no body and jumps
    nowhere, by construction) there is nothing to gain: what a system loses beyond the
    ceiling, `(L - L_ceiling) / (1 - L_ceiling)`, is taken from the sum. No metric adds
    less than -1 or more than 2.
    """
    names = [name for name, metric in SCORED.items() if metric.anchored]
    system, floor = _by_sample(rows), _by_sample(copy_last)
    samples = sorted(system)
    if (
        not samples
        or system.keys() != floor.keys()
        or not ceilings.keys() >= system.keys()
    ):
        unlike = sorted(system.keys() ^ floor.keys() | system.keys() - ceilings.keys())
        raise ValueError(
            f"anchored score: samples {unlike[:3]} have not all of a result, one of "
            "copy_last and a noise ceiling; evaluate all of them on the same list"
        )
    values = np.array(
        [
            [system[s].value(name) for name in names]
            + [floor[s].value(name) for name in names]
            + [ceilings[s][name] for name in names]
            for s in samples
        ]
    )
    losses = np.abs(values - np.tile([SCORED[name].best for name in names], 3))
    families = [system[s].family_id for s in samples]
    score = float(_anchored(losses.mean(axis=0)[None])[0])
    low, high = bootstrap(families, losses, _anchored, seed)
    return Interval(score, None, len(samples), len(set(families)), low, high)


def _by_sample(rows: Iterable[Row]) -> dict[str, Row]:
    found: dict[str, Row] = {}
    for row in rows:
        if row.sample_id in found:
            raise ValueError(
                f"{row.system} on {row.sample_id}: several rows, must be one per "
                "sample; select a candidate first (best_of_n)"
            )
        found[row.sample_id] = row
    return found


def _anchored(means: Columns) -> Columns:
    """Scores (R,) of mean losses (R, 3 M): of the system, copy_last, the ceiling."""
    system, floor, ceiling = np.split(means, 3, axis=1)
    gains = floor > ceiling
    scale = np.where(gains, floor - ceiling, 1.0)
    gained = np.clip((floor - system) / scale, LEAST, MOST)
    lost = np.maximum(system - ceiling, 0.0) / np.maximum(1.0 - ceiling, 1e-12)
    total = np.where(gains, gained, -lost).sum(axis=1)
    return np.asarray(total / np.maximum(gains.sum(axis=1), 1))


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
