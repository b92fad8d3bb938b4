"""Sudden jumps of colour."""

import colorsys
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mpmworlds.metrics import anomaly, anomaly_excess
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.definitions.anomaly import curve

# Hues and saturations away from the edges of their bins, where rounding decides.
PALETTE = np.array(
    [
        (0, 0, 0),
        (20, 30, 10),
        (255, 255, 255),
        (100, 100, 100),
        (250, 30, 0),
        (200, 180, 40),
        (60, 140, 255),
        (40, 160, 60),
        (150, 60, 200),
        (200, 140, 160),
    ],
    dtype=np.uint8,
)
SIDE = 12
CLIPS = arrays(np.int8, (9, 4, 4), elements=st.integers(0, len(PALETTE) - 1)).map(
    lambda index: PALETTE[index].repeat(3, axis=1).repeat(3, axis=2)
)
Bin = tuple[int, int, int]


def hsv_bin(colour: list[int]) -> Bin | None:
    if max(colour) <= 32:
        return None
    hue, saturation, value = colorsys.rgb_to_hsv(*(c / 255 for c in colour))
    return int(hue * 8), int(saturation * 255 / 64), int(value * 255 / 64)


def counted(frame: Clip, tile: tuple[int, int] | None) -> Counter[Bin | None]:
    if tile:
        rows, columns = (slice(i * 3, i * 3 + 3) for i in tile)
        frame = frame[rows, columns]
    return Counter(hsv_bin(colour) for colour in frame.reshape(-1, 3).tolist())


def local_jump(clip: Clip, t: int, tile: tuple[int, int], w: int) -> float:
    """J_w(t, r) by Counters of binned pixels; 0 where it has no value."""
    if not w <= t <= len(clip) - w:
        return 0.0
    sides = []
    for first in (t - w, t):
        total: Counter[Bin | None] = Counter()
        for frame in clip[first : first + w]:
            total += counted(frame, tile)
        sides.append(total)
    bins = sides[0].keys() | sides[1].keys()
    change = sum(abs(sides[0][b] - sides[1][b]) for b in bins) / w / 2
    foreground = max(sum(n for b, n in side.items() if b) for side in sides) / w
    return change / (foreground + 64)


def colour_jump(clip: Clip, t: int) -> float:
    """K(t)."""
    if not 1 <= t < len(clip):
        return 0.0
    before, after = counted(clip[t - 1], None), counted(clip[t], None)
    return max(
        (
            abs(before[b] - after[b]) / (max(before[b], after[b]) + 200)
            for b in (before.keys() | after.keys()) - {None}
        ),
        default=0.0,
    )


def excess(pred: Clip, ref: Clip, t: int) -> float:
    """e(t), term by term."""
    near = range(t - 4, t + 5)
    largest = colour_jump(pred, t) - max(colour_jump(ref, u) for u in near)
    for w in (1, 3):
        for i in range(4):
            for j in range(4):
                around = [
                    (k, m)
                    for k in range(max(i - 1, 0), min(i + 2, 4))
                    for m in range(max(j - 1, 0), min(j + 2, 4))
                ]
                excused = max(local_jump(ref, u, r, w) for u in near for r in around)
                largest = max(largest, local_jump(pred, t, (i, j), w) - excused)
    return max(largest, 0.0)


def dark(count: int, side: int = 64) -> Clip:
    return np.zeros((count, side, side, 3), dtype=np.uint8)


@settings(max_examples=4, deadline=None)
@given(pred=CLIPS, ref=CLIPS)
def test_excess_agrees_with_counted_pixels(pred: Clip, ref: Clip) -> None:
    expected = [excess(pred, ref, t) for t in range(1, 9)]
    assert curve(pred, ref).tolist() == pytest.approx(expected, abs=1e-12)
    still = np.repeat(ref[:1], 9, axis=0)
    expected = [excess(pred, still, t) for t in range(1, 9)]
    assert curve(pred, still).tolist() == pytest.approx(expected, abs=1e-12)


def test_body_that_pops_in_jumps_in_its_tile_and_in_its_colour() -> None:
    pred = dark(8)
    pred[4:, :10, :10] = (255, 0, 0)
    jumps = curve(pred, dark(8))
    assert jumps[3] == pytest.approx(max(100 / 164, 100 / 300))
    # Windows of three frames see it one frame before and after, too.
    assert jumps[2] == pytest.approx(200 / (200 + 192))
    assert jumps[4] == pytest.approx(200 / (300 + 192))
    assert anomaly_excess(pred, dark(8)) == jumps.max()
    assert anomaly(pred, dark(8)) == 1.0


def test_body_that_flickers_between_tiles_is_caught_by_its_colour() -> None:
    pred = dark(9)
    pred[:, 8:56, 8:56] = (255, 0, 0)
    pred[4, 8:56, 8:56] = (0, 0, 255)
    assert anomaly_excess(pred, pred[[0] * 9]) == pytest.approx(48**2 / (48**2 + 200))


def test_every_second_frame_black_is_an_anomaly() -> None:
    ref = dark(12)
    ref[:, 8:56, 8:56] = (255, 0, 0)
    pred = ref.copy()
    pred[1::2] = 0
    assert anomaly(pred, ref) == 1.0


@pytest.mark.parametrize(("shift", "expected"), [(-4, 0.0), (4, 0.0), (-5, 1.0)])
def test_jump_of_the_reference_excuses_four_frames_around(
    shift: int, expected: float
) -> None:
    pred, ref = dark(20), dark(20)
    pred[10:, :16, :16] = (255, 0, 0)
    ref[10 + shift :, :16, :16] = (255, 0, 0)
    assert anomaly(pred, ref) == expected
    if expected == 0.0:
        assert anomaly_excess(pred, ref) == 0.0


def test_jump_of_the_reference_excuses_the_tiles_around_only() -> None:
    pred, beside, far = dark(20), dark(20), dark(20)
    pred[10:, :16, :16] = (255, 0, 0)
    beside[10:, 16:32, 16:32] = (255, 0, 0)
    far[10:, 48:, 48:] = (255, 0, 0)
    assert anomaly_excess(pred, beside) == 0.0
    assert anomaly_excess(pred, far) == pytest.approx(256 / (256 + 64))


def test_jump_that_the_prediction_misses_is_no_excess() -> None:
    ref = dark(8)
    ref[4:] = 255
    assert anomaly_excess(dark(8), ref) == 0.0


def test_what_is_small_is_no_anomaly() -> None:
    pred = dark(8)
    pred[4:, :6, :6] = 255
    assert anomaly_excess(pred, dark(8)) == pytest.approx(36 / 100)
    assert anomaly(pred, dark(8)) == 0.0


def test_clip_is_anomalous_only_above_the_threshold() -> None:
    at, above = dark(2, 256), dark(2, 256)
    for clip, count in ((at, 78), (above, 79)):
        clip[1, :13, :6] = 255
        clip[1, 13, : count - 78] = 255
    assert anomaly_excess(at, dark(2, 256)) == pytest.approx(78 / 142)
    assert anomaly(at, dark(2, 256)) == 0.0
    assert anomaly(above, dark(2, 256)) == 1.0


def test_single_frame_has_no_jump_and_two_have_one() -> None:
    for count in (1, 2):
        pred = dark(count)
        pred[count // 2 :] = 255
        jumps = curve(pred, dark(count))
        assert jumps.shape == (count - 1,)
        assert anomaly(pred, dark(count)) == float(count == 2)


def test_two_still_clips_have_no_anomaly() -> None:
    pred = dark(8)
    pred[:] = 200
    assert anomaly_excess(pred, dark(8)) == 0.0
