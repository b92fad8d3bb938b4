"""Of N candidates one: chosen on the prefix, at random, or by who knows the truth."""

from collections.abc import Iterable
from dataclasses import replace

from mpmworlds.metrics.aggregate import VALID, Row
from mpmworlds.metrics.registry import metric_named


def _chosen(candidates: list[Row], metric: str) -> int:
    """Return the number of the best valid candidate, else the first one's.

    Ties go to the lowest number: a saturated metric then chooses as if N were 1.
    """
    ordered = sorted(candidates, key=lambda row: row.candidate)
    best: Row | None = None
    for row in ordered:
        if row.scores is not None and (
            best is None
            or metric_named(metric).is_better(row.value(metric), best.value(metric))
        ):
            best = row
    return (best or ordered[0]).candidate


def _by_candidate(rows: Iterable[Row]) -> dict[tuple[str, str, int], Row]:
    """Index rows by system, sample and candidate."""
    index: dict[tuple[str, str, int], Row] = {}
    for row in rows:
        key = (row.system, row.sample_id, row.candidate)
        if key in index:
            raise ValueError(
                f"{row.system} on {row.sample_id}, candidate {row.candidate}: several "
                "rows, must be one; number the candidates of a sample 0 to N - 1"
            )
        index[key] = row
    return index


def best_of_n(
    prefix: Iterable[Row], continuation: Iterable[Row], metric: str
) -> list[Row]:
    """Keep one candidate per system and sample, chosen on the prefix alone.

    Top-1 per metric (the paper's protocol) is
    ``summarise(best_of_n(prefix, continuation, m), m)`` for each metric m.

    Parameters
    ----------
    prefix : iterable of Row
        All candidates scored on the prefix, failures included.
    continuation : iterable of Row
        The same candidates scored on the continuation.
    metric : str
        Metric whose value is wanted: it ranks the candidates, or the one does that
        chooses for it (`Metric.selected_by`).

    Returns
    -------
    list of Row
        One continuation row per system and sample, sorted by both: that of the best
        valid candidate on the prefix, ties to the lowest number. It may be a failure:
        the choice never looks at the continuation. Without a valid candidate the
        sample failed, as its first candidate did.

    Raises
    ------
    ValueError
        If the metric is unknown, or if the two do not hold the same candidates, once.
    """
    ranks = metric_named(metric).selected_by or metric
    early, late = _by_candidate(prefix), _by_candidate(continuation)
    if early.keys() != late.keys():
        system, sample, candidate = min(early.keys() ^ late.keys())
        raise ValueError(
            f"{system} on {sample}, candidate {candidate}: scored on one of prefix and "
            "continuation, must be on both; pass its failure as a row too"
        )
    return [
        late[rows[0].system, rows[0].sample_id, _chosen(rows, ranks)]
        for rows in _groups(early.values())
    ]


def random_of_n(rows: Iterable[Row], metric: str) -> list[Row]:
    """Score what a candidate drawn at random comes to, on average.

    Parameters
    ----------
    rows : iterable of Row
        All candidates scored on the continuation, failures included.
    metric : str
        Metric of which the mean is taken; a failure counts as its worst value.

    Returns
    -------
    list of Row
        One row per system and sample, with that metric alone; candidate 0. A sample
        without a valid candidate failed, as its first one did.

    Raises
    ------
    ValueError
        If the metric is unknown, or a candidate is there twice.
    """
    metric_named(metric)
    found = []
    for candidates in _groups(rows):
        values = [row.value(metric) for row in candidates]
        if any(row.scores is not None for row in candidates):
            mean = {metric: sum(values) / len(values)}
            first = replace(candidates[0], outcome=VALID, scores=mean)
        else:
            first = candidates[0]
        found.append(replace(first, candidate=0))
    return found


def oracle_of_n(rows: Iterable[Row], metric: str) -> list[Row]:
    """Keep the candidate whose continuation is best: what a perfect choice is worth.

    Parameters
    ----------
    rows : iterable of Row
        All candidates scored on the continuation, failures included.
    metric : str
        Metric that tells.

    Returns
    -------
    list of Row
        One row per system and sample, ties to the lowest number; a failure only where
        all candidates failed.

    Raises
    ------
    ValueError
        If the metric is unknown, or a candidate is there twice.
    """
    index = _by_candidate(rows)
    return [
        index[group[0].system, group[0].sample_id, _chosen(group, metric)]
        for group in _groups(index.values())
    ]


def _groups(rows: Iterable[Row]) -> list[list[Row]]:
    """Candidates by system and sample, in order."""
    index = _by_candidate(rows)
    groups: dict[tuple[str, str], list[Row]] = {}
    for system, sample, candidate in sorted(index):
        groups.setdefault((system, sample), []).append(index[system, sample, candidate])
    return [*groups.values()]
