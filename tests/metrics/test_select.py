"""Best of N by the prefix."""

import pytest

from mpmworlds.metrics import Row, best_of_n, summarise


def rows(sample: str, *values: float | None, metric: str = "mse") -> list[Row]:
    """Make one row per candidate; None is a failure."""
    return [
        Row(sample, sample, "a", k, "ok", {metric: v})
        if v is not None
        else Row(sample, sample, "a", k, f"crash {k}", None)
        for k, v in enumerate(values)
    ]


def test_choice_is_by_the_prefix_and_score_by_the_continuation() -> None:
    prefix = rows("p1", 0.3, 0.1, 0.2)
    continuation = rows("p1", 0.0, 0.9, 0.5)
    assert best_of_n(prefix, continuation, "mse") == [continuation[1]]


def test_choice_follows_the_direction_of_the_metric() -> None:
    prefix = rows("p1", 0.3, 0.1, 0.4, metric="mask_iou")
    continuation = rows("p1", 0.3, 0.1, 0.2, metric="mask_iou")
    assert best_of_n(prefix, continuation, "mask_iou") == [continuation[2]]


def test_ties_go_to_the_lowest_candidate_whatever_the_order() -> None:
    prefix, continuation = rows("p1", None, 0.2, 0.2), rows("p1", None, 0.8, 0.1)
    assert best_of_n(prefix[::-1], continuation, "mse") == [continuation[1]]


def test_failed_candidates_are_not_chosen_while_one_is_valid() -> None:
    prefix, continuation = rows("p1", None, 1.0), rows("p1", None, 0.9)
    assert best_of_n(prefix, continuation, "mse") == [continuation[1]]


def test_sample_without_valid_candidate_failed() -> None:
    failed = rows("p1", None, None)
    chosen = best_of_n(failed, failed, "mse")
    assert [r.outcome for r in chosen] == ["crash 0"]
    assert summarise(chosen, "mse")["a"].failures_at_worst.mean == 1.0


def test_choice_never_looks_at_the_continuation() -> None:
    prefix, continuation = rows("p1", 0.1, 0.2), rows("p1", None, 0.2)
    assert best_of_n(prefix, continuation, "mse") == [continuation[0]]


def test_every_system_and_sample_keeps_one_row_in_order() -> None:
    prefix = rows("p2", 0.2, 0.1) + rows("p1", 0.1, 0.2)
    chosen = best_of_n(prefix, prefix, "mse")
    assert [(r.sample_id, r.candidate) for r in chosen] == [("p1", 0), ("p2", 1)]


def test_candidate_without_its_other_half_is_refused() -> None:
    prefix = rows("p1", 0.1, 0.2)
    with pytest.raises(ValueError, match=r"a on p1, candidate 1: scored on one"):
        best_of_n(prefix, prefix[:1], "mse")


def test_repeated_candidate_and_unknown_metric_are_refused() -> None:
    prefix = rows("p1", 0.1)
    with pytest.raises(ValueError, match=r"a on p1, candidate 0: several rows"):
        best_of_n(prefix * 2, prefix, "mse")
    with pytest.raises(ValueError, match="metric 'ssim': unknown"):
        best_of_n(prefix, prefix, "ssim")


def test_missing_ranking_metric_is_refused() -> None:
    prefix = rows("p1", 0.1, 0.2)
    with pytest.raises(ValueError, match=r"candidate \d: no wmae"):
        best_of_n(prefix, prefix, "wmae")


def test_what_stands_beside_a_metric_of_the_paper_is_chosen_by_that_metric() -> None:
    early = {"collapse": [0.3, 0.1], "collapse_excess": [0.0, 0.1]}
    rows = [
        Row("p0001", "p0001", "one", k, "ok", {m: v[k] for m, v in early.items()})
        for k in range(2)
    ]
    (chosen,) = best_of_n(rows, rows, "collapse_excess")
    assert chosen.candidate == 1
