"""Summaries over samples."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from mpmworlds.metrics import Row, summarise


def row(
    sample: str, value: float | None, system: str = "a", metric: str = "mse"
) -> Row:
    """Make the row of a sample `p0001-c2` of family `p0001`; None is a crash."""
    family = sample.split("-")[0]
    if value is None:
        return Row(sample, family, system, 0, "crash", None)
    return Row(sample, family, system, 0, "ok", {metric: value})


ROWS = [
    row("p1-c0", 0.1),
    row("p1-c1", 0.3),
    row("p2-c0", None),
    row("p3-c0", 0.2),
    row("p1-c0", 0.5, "b"),
    row("p1-c1", None, "b"),
    row("p2-c0", 0.7, "b"),
    row("p3-c0", 0.9, "b"),
]


def test_valid_summary_leaves_failures_out() -> None:
    valid = summarise(ROWS, "mse")["a"].valid
    assert (valid.n, valid.families) == (3, 2)
    assert valid.mean == pytest.approx(0.2)
    assert valid.sem == pytest.approx(0.1 / math.sqrt(3))


def test_failures_score_the_worst_value() -> None:
    worst = summarise(ROWS, "mse")["a"].failures_at_worst
    assert (worst.n, worst.families) == (4, 3)
    assert worst.mean == pytest.approx((0.1 + 0.3 + 1.0 + 0.2) / 4)


def test_failure_scores_zero_where_up_is_better() -> None:
    rows = [row("p1", 0.8, metric="mask_iou"), row("p2", None)]
    summary = summarise(rows, "mask_iou")["a"]
    assert summary.failures_at_worst.mean == pytest.approx(0.4)


def test_paired_summary_keeps_samples_valid_for_all_systems() -> None:
    summaries = summarise(ROWS, "mse")
    assert [*summaries] == ["a", "b"]
    assert summaries["a"].paired.mean == pytest.approx((0.1 + 0.2) / 2)
    assert summaries["b"].paired.mean == pytest.approx((0.5 + 0.9) / 2)
    assert summaries["a"].paired.n == summaries["b"].paired.n == 2


def test_sample_that_a_system_never_saw_is_not_paired() -> None:
    rows = [row("p1", 0.1), row("p2", 0.3), row("p1", 0.5, "b")]
    assert summarise(rows, "mse")["a"].paired.n == 1


def test_paired_equals_valid_for_a_single_system() -> None:
    summary = summarise([r for r in ROWS if r.system == "a"], "mse")["a"]
    assert summary.paired == summary.valid


def test_samples_of_one_family_are_resampled_together() -> None:
    # A resample of ten families, half of them zeros, has a mean with a deviation of
    # 0.16; of 80 independent samples it would be 0.06.
    rows = [row(f"p{k}-c{j}", float(k < 5)) for k in range(10) for j in range(8)]
    together = summarise(rows, "mse")["a"].valid
    assert together.low is not None
    assert together.high is not None
    assert together.low <= 0.2 < 0.8 <= together.high
    apart = [replace(r, family_id=r.sample_id) for r in rows]
    alone = summarise(apart, "mse")["a"].valid
    assert alone.low is not None
    assert alone.high is not None
    assert 0.35 <= alone.low < 0.5 < alone.high <= 0.65


def test_families_weigh_by_their_samples() -> None:
    rows = [row(f"p0-c{k}", 0.0) for k in range(12)]
    rows += [row(f"p{k}", 1.0) for k in range(1, 10)]
    valid = summarise(rows, "mse")["a"].valid
    assert valid.mean == pytest.approx(9 / 21)
    assert valid.high == 1.0  # of three resamples one is without p0


def test_there_is_no_interval_of_few_families() -> None:
    nine = [row(f"p{k % 9}-c{k}", k / 90) for k in range(90)]
    valid = summarise(nine, "mse")["a"].valid
    assert (valid.families, valid.low, valid.high) == (9, None, None)
    ten = [row(f"p{k % 10}-c{k}", k / 90) for k in range(90)]
    assert summarise(ten, "mse")["a"].valid.low is not None


def test_interval_agrees_with_an_independent_bootstrap() -> None:
    generator = np.random.default_rng(5)
    values = {f"p{k}": generator.random(generator.integers(1, 5)) for k in range(30)}
    rows = [
        row(f"{family}-c{k}", float(v))
        for family, column in values.items()
        for k, v in enumerate(column)
    ]
    interval = summarise(rows, "mse")["a"].valid
    picker = random.Random(7)
    means = sorted(
        float(np.concatenate(picker.choices(list(values.values()), k=30)).mean())
        for _ in range(4000)
    )
    assert interval.low == pytest.approx(means[100], abs=0.01)
    assert interval.high == pytest.approx(means[3900], abs=0.01)


def test_interval_covers_a_normal_mean_as_its_standard_error_says() -> None:
    generator = np.random.default_rng(3)
    rows = [row(f"p{k}", float(v)) for k, v in enumerate(generator.normal(size=400))]
    valid = summarise(rows, "mse")["a"].valid
    assert valid.mean is not None
    assert valid.sem is not None
    assert valid.low == pytest.approx(valid.mean - 1.96 * valid.sem, abs=0.01)
    assert valid.high == pytest.approx(valid.mean + 1.96 * valid.sem, abs=0.01)


def test_summary_depends_on_the_seed_alone_and_not_on_the_order_of_rows() -> None:
    generator = np.random.default_rng(1)
    rows = [row(f"p{k % 11}-c{k}", float(generator.random())) for k in range(40)]
    assert summarise(rows, "mse") == summarise(rows[::-1], "mse")
    assert summarise(rows, "mse") != summarise(rows, "mse", seed=1)


def test_undefined_numbers_are_none() -> None:
    summary = summarise([row("p1", None)], "mse")["a"]
    assert summary.valid.mean is None
    assert summary.valid.n == 0
    assert summary.failures_at_worst.mean == 1.0
    assert summary.failures_at_worst.sem is None
    one_family = summarise([row("p1-c0", 0.1), row("p1-c1", 0.3)], "mse")["a"].valid
    assert one_family.sem == pytest.approx(0.1)
    assert (one_family.low, one_family.high) == (None, None)


def test_no_rows_give_no_summaries() -> None:
    assert summarise([], "mse") == {}


def test_several_candidates_of_one_sample_are_refused() -> None:
    rows = [row("p1", 0.1), replace(row("p1", 0.2), candidate=1)]
    with pytest.raises(ValueError, match=r"a on p1: several rows.*best_of_n"):
        summarise(rows, "mse")


def test_missing_and_unknown_metrics_are_refused() -> None:
    with pytest.raises(ValueError, match=r"a on p1, candidate 0: no wmae.*\['mse'\]"):
        summarise([row("p1", 0.1)], "wmae")
    with pytest.raises(ValueError, match="metric 'ssim': unknown"):
        summarise([row("p1", 0.1)], "ssim")


def test_row_is_valid_exactly_when_it_has_scores() -> None:
    with pytest.raises(ValueError, match="a on p1, candidate 2: outcome 'crash'"):
        Row("p1", "p1", "a", 2, "crash", {"mse": 0.0})
    with pytest.raises(ValueError, match="outcome 'ok' with scores None"):
        Row("p1", "p1", "a", 0, "ok", None)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_row_refuses_scores_that_are_not_finite(value: float) -> None:
    with pytest.raises(ValueError, match=r"a on p1.*mse = (nan|inf), must be finite"):
        row("p1", value)
