"""Best of N: choose a candidate on the prefix, score it on the continuation."""

from collections.abc import Iterable

from mpmworlds.metrics.aggregate import Row
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
        Metric that ranks the candidates.

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
    metric_named(metric)
    early, late = _by_candidate(prefix), _by_candidate(continuation)
    if early.keys() != late.keys():
        system, sample, candidate = min(early.keys() ^ late.keys())
        raise ValueError(
            f"{system} on {sample}, candidate {candidate}: scored on one of prefix and "
            "continuation, must be on both; pass its failure as a row too"
        )
    groups: dict[tuple[str, str], list[Row]] = {}
    for system, sample, candidate in sorted(early):
        groups.setdefault((system, sample), []).append(early[system, sample, candidate])
    return [late[(*key, _chosen(rows, metric))] for key, rows in groups.items()]
