"""Sliced Wasserstein distance of foregrounds."""

from itertools import pairwise

import numpy as np
import ot
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import wasserstein_distance

from mpmworlds.metrics import semd
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.definitions.semd import curve

ANGLES = [np.pi * k / 16 for k in range(16)]
MASKS = st.sampled_from([(1, 1), (5, 5), (4, 9), (9, 4), (1, 7)]).flatmap(
    lambda shape: st.tuples(arrays(bool, (2, *shape)), arrays(bool, (2, *shape)))
)


def painted(mask: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Clip:
    return np.repeat(mask[..., None].astype(np.uint8) * np.uint8(255), 3, axis=-1)


def pixel(row: int, column: int, side: int = 16) -> Clip:
    mask = np.zeros((1, side, side), dtype=bool)
    mask[0, row, column] = True
    return painted(mask)


def wasserstein_1(a: list[float], b: list[float]) -> float:
    """Integrate |Q_a(u) - Q_b(u)| over u, exactly: both are step functions.

    In units of 1 / (len(a) len(b)), all steps lie at whole numbers.
    """
    a, b = sorted(a), sorted(b)
    steps = sorted(
        {i * len(b) for i in range(len(a) + 1)}
        | {j * len(a) for j in range(len(b) + 1)}
    )
    total = 0.0
    for start, end in pairwise(steps):
        total += abs(a[start // len(b)] - b[start // len(a)]) * (end - start)
    return total / (len(a) * len(b))


def sliced(pred: Clip, ref: Clip) -> float:
    side = max(pred.shape[:2])
    points_p, points_r = np.argwhere(pred[..., 0]), np.argwhere(ref[..., 0])
    if not len(points_p) or not len(points_r):
        return float(len(points_p) != len(points_r))
    distances = [
        wasserstein_1(
            (points_p / side @ (np.sin(angle), np.cos(angle))).tolist(),
            (points_r / side @ (np.sin(angle), np.cos(angle))).tolist(),
        )
        for angle in ANGLES
    ]
    return float(np.mean(distances))


@settings(max_examples=60, deadline=None)
@given(masks=MASKS)
def test_distance_agrees_with_quantile_functions(
    masks: tuple[np.ndarray, np.ndarray],
) -> None:
    pred, ref = painted(masks[0]), painted(masks[1])
    expected = [sliced(p, r) for p, r in zip(pred, ref, strict=True)]
    assert curve(pred, ref).tolist() == pytest.approx(expected, abs=1e-12)


def test_distance_agrees_with_quantile_functions_on_large_masks() -> None:
    random = np.random.default_rng(0)
    pred = painted(random.random((1, 64, 64)) < 0.6)
    ref = painted(random.random((1, 64, 64)) < np.linspace(0, 1, 64))
    assert semd(pred, ref) == pytest.approx(sliced(pred[0], ref[0]), abs=1e-12)


def test_distance_agrees_with_scipy_and_with_pot() -> None:
    random = np.random.default_rng(2)
    pred = painted(random.random((1, 40, 40)) < 0.2)
    ref = painted(random.random((1, 40, 40)) < np.linspace(0, 0.5, 40))
    ways = np.stack([np.cos(ANGLES), np.sin(ANGLES)])
    points = [np.argwhere(clip[0, ..., 0])[:, ::-1] / 40 for clip in (pred, ref)]
    lines = [p @ ways for p in points]
    by_scipy = np.mean(
        [wasserstein_distance(lines[0][:, k], lines[1][:, k]) for k in range(16)]
    )
    assert semd(pred, ref) == pytest.approx(by_scipy, abs=1e-12)
    by_pot = ot.sliced_wasserstein_distance(*points, projections=ways, p=1)
    assert semd(pred, ref) == pytest.approx(by_pot, abs=1e-12)


def test_distance_of_two_pixels_is_the_mean_projected_offset() -> None:
    offset = 3 / 16, 4 / 16
    expected = np.mean(
        [abs(offset[0] * np.sin(a) + offset[1] * np.cos(a)) for a in ANGLES]
    )
    assert semd(pixel(2, 5), pixel(5, 9)) == pytest.approx(expected)


def test_distance_of_translated_shapes_is_that_of_their_offset() -> None:
    random = np.random.default_rng(1)
    mask = np.zeros((1, 16, 16), dtype=bool)
    mask[0, 2:9, 2:9] = random.random((7, 7)) < 0.5
    moved = np.roll(mask, (3, 4), axis=(1, 2))
    assert semd(painted(mask), painted(moved)) == pytest.approx(
        semd(pixel(2, 5), pixel(5, 9))
    )


def test_opposite_corners_stay_below_the_worst_value() -> None:
    assert 0.85 < semd(pixel(0, 0, side=256), pixel(255, 255, side=256)) < 0.91


def test_two_empty_foregrounds_are_equal_and_one_is_farthest() -> None:
    empty = np.zeros((1, 16, 16, 3), dtype=np.uint8)
    assert semd(empty, empty) == 0.0
    assert semd(empty, pixel(3, 3)) == 1.0
    assert semd(pixel(3, 3), empty) == 1.0


def test_distance_ignores_colour() -> None:
    assert semd(pixel(3, 3) // 5, pixel(3, 3)) == 0.0


def test_distance_does_not_depend_on_the_number_of_pixels() -> None:
    one = np.zeros((1, 8, 8), dtype=bool)
    one[0, 3, 3] = True
    ring = np.zeros((1, 8, 8), dtype=bool)
    ring[0, 2:5, 2:5] = True
    near = semd(painted(one), painted(ring))
    assert 0.0 < near < 1.0 / 8


def test_rectangles_are_measured_by_their_longer_side() -> None:
    tall = np.zeros((1, 20, 10, 3), dtype=np.uint8)
    pred, ref = tall.copy(), tall.copy()
    pred[0, 1, 1], ref[0, 6, 1] = 255, 255
    square = pixel(1, 1, side=20), pixel(6, 1, side=20)
    assert semd(pred, ref) == pytest.approx(semd(*square))
