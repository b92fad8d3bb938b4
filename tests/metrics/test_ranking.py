"""One number per system."""

from dataclasses import replace

import pytest

from mpmworlds.metrics import SCORED, Row, anchored_score, normalised_scores

ANCHORED = [name for name, metric in SCORED.items() if metric.anchored]
FLOOR = {
    "mask_iou": 0.5,
    "wmae": 1.0,
    "color_tv": 0.1,
    "collapse_excess": 0.0,
    "anomaly": 0.0,
}
CEILING = {
    "mask_iou": 0.9,
    "wmae": 0.2,
    "color_tv": 0.02,
    "collapse_excess": 0.05,
    "anomaly": 0.0,
}
SAMPLES = [f"p{k % 12:04d}-c{k}" for k in range(24)]


def rows(system: str, values: dict[str, float] | None) -> list[Row]:
    """One row per sample, all with the same values; None is a crash."""
    outcome = "ok" if values is not None else "crash"
    return [Row(s, s.split("-")[0], system, 0, outcome, values) for s in SAMPLES]


CEILINGS = dict.fromkeys(SAMPLES, CEILING)


def anchored(values: dict[str, float] | None) -> float:
    found = anchored_score(rows("a", values), rows("copy_last", FLOOR), CEILINGS)
    assert found.mean is not None
    return found.mean


def test_the_anchors_score_zero_and_one() -> None:
    assert set(FLOOR) == set(ANCHORED)
    assert anchored(FLOOR) == pytest.approx(0.0)
    assert anchored(CEILING) == pytest.approx(1.0)


def test_halfway_between_the_anchors_scores_a_half() -> None:
    halfway = {name: (FLOOR[name] + CEILING[name]) / 2 for name in ANCHORED}
    assert anchored(halfway) == pytest.approx(0.5)


def test_the_truth_is_above_the_ceiling() -> None:
    truth = {name: SCORED[name].best for name in ANCHORED}
    gains = (1 - 0.5) / 0.4, 1.0 / 0.8, 0.1 / 0.08
    assert anchored(truth) == pytest.approx(sum(gains) / 3)


def test_a_metric_on_which_the_anchors_hardly_differ_does_not_decide_alone() -> None:
    near = CEILING | {"color_tv": FLOOR["color_tv"] - 1e-6}
    ceilings = dict.fromkeys(SAMPLES, near)
    truth = rows("a", {name: SCORED[name].best for name in ANCHORED})
    found = anchored_score(truth, rows("copy_last", FLOOR), ceilings)
    assert found.mean == pytest.approx(((1 - 0.5) / 0.4 + 1.0 / 0.8 + 2.0) / 3)


@pytest.mark.parametrize("name", ANCHORED)
def test_worse_never_scores_more(name: str) -> None:
    worst = SCORED[name].worst
    steps = [CEILING[name] + (worst - CEILING[name]) * k / 8 for k in range(9)]
    scores = [anchored(CEILING | {name: value}) for value in steps]
    assert scores == sorted(scores, reverse=True)
    assert scores[-1] < scores[0]
    assert scores[0] - scores[-1] <= 2 / 3 + 1e-12  # no metric decides alone


def test_what_copying_cannot_lose_is_taken_from_the_others() -> None:
    breaks = CEILING | {"anomaly": 1.0}
    assert anchored(breaks) == pytest.approx((3 - 1) / 3)
    loses = CEILING | {"collapse_excess": 0.05 + 0.95 / 2}
    assert anchored(loses) == pytest.approx((3 - 0.5) / 3)


def test_a_system_that_always_fails_is_below_copying() -> None:
    assert anchored(None) == pytest.approx((-1 + 0 - 1 - 1 - 1) / 3)


def test_interval_is_of_resampled_families_and_holds_the_score() -> None:
    good, bad = rows("a", CEILING), rows("a", FLOOR)
    mixed = [
        g if k % 12 < 6 else b for k, (g, b) in enumerate(zip(good, bad, strict=True))
    ]
    found = anchored_score(mixed, rows("copy_last", FLOOR), CEILINGS)
    assert (found.n, found.families) == (24, 12)
    assert found.low is not None
    assert found.high is not None
    assert found.low < 0.3 < 0.5 < 0.7 < found.high
    again = anchored_score(mixed[::-1], rows("copy_last", FLOOR), CEILINGS)
    assert again == found


def test_samples_must_be_the_same() -> None:
    some = rows("a", CEILING)
    with pytest.raises(ValueError, match=r"samples \['p0000-c0'\] have not all"):
        anchored_score(some[1:], rows("copy_last", FLOOR), CEILINGS)
    with pytest.raises(ValueError, match="have not all"):
        anchored_score(some, rows("copy_last", FLOOR), {})
    with pytest.raises(ValueError, match="have not all"):
        anchored_score([], [], CEILINGS)
    with pytest.raises(ValueError, match="a on p0000-c0: several rows"):
        anchored_score([*some, replace(some[0])], rows("copy_last", FLOOR), CEILINGS)


def test_normalised_score_of_three_worked_rows() -> None:
    means = {
        "best": {"mask_iou": 0.9, "mse": 0.1},
        "middle": {"mask_iou": 0.6, "mse": 0.3},
        "last": {"mask_iou": 0.5, "mse": 0.5},
    }
    scores = normalised_scores(means)
    assert scores["best"] == pytest.approx(1.0)
    assert scores["middle"] == pytest.approx((0.25 + 0.5) / 2)
    assert scores["last"] == pytest.approx(0.0)


def test_metric_on_which_rows_tie_changes_no_order() -> None:
    means = {"x": {"mse": 0.1, "wmae": 0.4}, "y": {"mse": 0.2, "wmae": 0.4}}
    assert normalised_scores(means) == {"x": 0.75, "y": 0.25}
    assert normalised_scores({"only": {"mse": 0.3}}) == {"only": 0.5}


def test_normalised_score_refuses_rows_with_different_metrics() -> None:
    with pytest.raises(ValueError, match=r"row 'y': metrics \['mse'\].*\['mse', 'semd"):
        normalised_scores({"x": {"mse": 0.1, "semd": 0.1}, "y": {"mse": 0.2}})
    with pytest.raises(ValueError, match="row 'x': metrics"):
        normalised_scores({"x": {}})
