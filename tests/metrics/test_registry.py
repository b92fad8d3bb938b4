"""Properties that every metric of the registry has."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from threadpoolctl import threadpool_limits

import mpmworlds.metrics
from mpmworlds.metrics import METRICS, SCORED, Metric, View, metric_named, score
from mpmworlds.metrics.clips import Clip

LEVELS = st.sampled_from([0, 20, 33, 90, 128, 255])
CLIPS = arrays(np.uint8, (7, 6, 9, 3), elements=LEVELS)
BODIES = np.zeros((2, 4, 200, 200, 3), dtype=np.uint8)  # pred, ref
BODIES[0, :, 20:140, 30:170] = (255, 80, 0)
BODIES[1, :, 33:180, 10:140] = (0, 90, 255)
BODIES[:, 2:, 150:190, 5:80] = (30, 250, 60)
each_metric = pytest.mark.parametrize("metric", SCORED.values(), ids=SCORED.keys())
SYMMETRIC = ["mask_iou", "wmae", "color_tv", "semd", "mse"]  # by definition


def noise(seed: int, shape: tuple[int, ...] = (7, 12, 12, 3)) -> Clip:
    random = np.random.default_rng(seed)
    return random.integers(0, 256, shape, dtype=np.uint8)


def test_the_seven_of_the_paper_are_registered_in_its_order() -> None:
    assert [m.paper_name for m in METRICS.values()] == [
        "mIoU",
        "OCS",
        "W-MAE",
        "CTV",
        "RTSJ",
        "SEMD",
        "MSE",
    ]
    assert [*SCORED][: len(METRICS)] == [*METRICS]


@each_metric
def test_registered_function_is_the_exported_one(metric: Metric) -> None:
    assert metric.function is getattr(mpmworlds.metrics, metric.name)
    assert metric.name in mpmworlds.metrics.__all__


@each_metric
def test_best_is_better_than_worst_and_both_are_bounds(metric: Metric) -> None:
    assert metric.is_better(metric.best, metric.worst)
    assert {metric.best, metric.worst} == {0.0, 1.0}


def test_columns_are_distinct() -> None:
    columns = [metric.column for metric in SCORED.values()]
    assert columns == sorted(set(columns))


def test_better_follows_the_direction_and_is_strict() -> None:
    assert METRICS["mask_iou"].is_better(0.9, 0.1)
    assert METRICS["mse"].is_better(0.1, 0.9)
    assert not any(m.is_better(0.5, 0.5) for m in SCORED.values())


def test_unknown_metric_error_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"metric 'ssim': unknown.*'mask_iou'.*'mse'"):
        metric_named("ssim")


@settings(max_examples=30, deadline=None)
@given(pred=CLIPS, ref=CLIPS)
def test_every_score_lies_between_zero_and_one(pred: Clip, ref: Clip) -> None:
    scores = score(pred, ref)
    assert [*scores] == [*SCORED]
    for name, value in scores.items():
        assert 0.0 <= value <= 1.0, name


@settings(max_examples=30, deadline=None)
@given(clip=CLIPS)
def test_identity_scores_the_best_value(clip: Clip) -> None:
    for name, value in score(clip, clip.copy()).items():
        assert value == SCORED[name].best or not SCORED[name].needs_reference


@settings(max_examples=30, deadline=None)
@given(pred=CLIPS, ref=CLIPS)
def test_compared_clips_may_be_swapped(pred: Clip, ref: Clip) -> None:
    forth, back = score(pred, ref), score(ref, pred)
    assert {n: forth[n] for n in SYMMETRIC} == pytest.approx(
        {n: back[n] for n in SYMMETRIC}, abs=1e-12
    )


def test_score_equals_the_metrics_one_by_one() -> None:
    pred, ref = noise(1), noise(2)
    assert score(pred, ref) == {n: m(pred, ref) for n, m in SCORED.items()}


@each_metric
def test_metric_leaves_its_arguments_alone(metric: Metric) -> None:
    pred, ref = noise(1), noise(2)
    pred.flags.writeable = ref.flags.writeable = False
    metric(pred, ref)
    assert np.array_equal(pred, noise(1))
    assert np.array_equal(ref, noise(2))


@each_metric
def test_views_score_like_copies(metric: Metric) -> None:
    wide = noise(3, (16, 12, 26, 3))
    pred, ref = wide[1::2, ::-1, :24:2, ::-1], wide[::2, :, 1:25:2]
    copies = np.ascontiguousarray(pred), np.ascontiguousarray(ref)
    assert metric(pred, ref) == metric(*copies)


@each_metric
def test_single_frame_clips_have_a_score(metric: Metric) -> None:
    value = metric(noise(1, (1, 8, 8, 3)), noise(2, (1, 8, 8, 3)))
    assert 0.0 <= value <= 1.0


@each_metric
def test_curve_ends_with_the_last_frame_and_has_the_scale_of_the_metric(
    metric: Metric,
) -> None:
    pred, ref = noise(1), noise(2)
    curve = metric.curve_of(pred, ref)
    assert curve.shape in {(7,), (6,)}
    assert ((curve >= 0.0) & (curve <= 1.0)).all()
    shorter = metric.curve_of(pred[:4], ref[:4])
    assert len(curve) - len(shorter) == 3


@each_metric
def test_metric_has_the_same_bits_whatever_the_threads_of_the_blas(
    metric: Metric,
) -> None:
    with threadpool_limits(1):
        one = metric(*BODIES)
    with threadpool_limits(2):
        assert metric(*BODIES) == one


@pytest.mark.parametrize("name", ["mask_iou", "color_tv", "semd", "mse"])
def test_metric_is_the_mean_of_its_curve(name: str) -> None:
    pred, ref = noise(1), noise(2)
    curve = METRICS[name].curve_of(pred, ref)
    assert curve.shape == (7,)
    assert METRICS[name](pred, ref) == pytest.approx(curve.mean())


@pytest.mark.parametrize("name", ["mask_iou", "color_tv", "semd", "mse"])
def test_curve_of_one_frame_depends_on_that_frame_alone(name: str) -> None:
    pred, ref = noise(1), noise(2)
    whole = METRICS[name].curve_of(pred, ref)
    single = [METRICS[name](pred[t : t + 1], ref[t : t + 1]) for t in range(7)]
    assert whole.tolist() == pytest.approx(single, abs=1e-12)


@pytest.mark.parametrize("name", ["wmae", "anomaly", "anomaly_excess", "color_tv"])
@pytest.mark.parametrize("shape", [(1, 3, 8, 3), (1, 8, 3, 3), (9, 3, 8, 3)])
def test_images_too_small_for_tiles_are_refused(
    name: str, shape: tuple[int, ...]
) -> None:
    clip = noise(1, shape)
    with pytest.raises(ValueError, match=r"image side = 3 px, must be >= 4"):
        SCORED[name](clip, clip)


@each_metric
@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), shared=st.integers(0, 19))
def test_no_prediction_gets_better_than_the_bound_of_its_beginning(
    metric: Metric, seed: int, shared: int
) -> None:
    ref = noise(seed, (20, 8, 8, 3)) * (noise(seed + 1, (20, 8, 8, 1)) > 128)
    pred = noise(seed + 2, (20, 8, 8, 3)) * (noise(seed + 3, (20, 8, 8, 1)) > 128)
    pred[shared:] = ref[shared:]  # the best that can follow, more or less
    final, whole = metric(pred, ref), View(ref)
    bounds = [metric.best_of_begun(View(pred[:k]), whole) for k in range(1, 21)]
    for bound in bounds:
        assert bound == pytest.approx(final, abs=1e-12) or not metric.is_better(
            final, bound
        )


@pytest.mark.parametrize("name", ["mask_iou", "collapse", "color_tv", "semd", "mse"])
def test_the_bound_of_a_whole_prediction_is_its_value(name: str) -> None:
    metric = SCORED[name]
    pred = noise(1, (20, 8, 8, 3)) * (noise(2, (20, 8, 8, 1)) > 128)
    bound = metric.best_of_begun(View(pred), View(pred[::-1]))
    assert bound == pytest.approx(metric(pred, pred[::-1]), abs=1e-12)
    assert bound != metric.best


def test_every_metric_is_selected_by_one_of_the_paper() -> None:
    assert all((m.selected_by or name) in METRICS for name, m in SCORED.items())
