"""Sudden local colour jumps."""

import colorsys
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mpmworlds.metrics import anomaly, anomaly_excess
from mpmworlds.metrics.anomaly import curve
from mpmworlds.metrics.clips import Clip

# Hues and saturations away from the edges of their bins, where rounding decides.
PALETTE = np.array(
    [
        (0, 0, 0),
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
CLIPS = arrays(np.int8, (8, 5, 4), elements=st.integers(0, len(PALETTE) - 1)).map(
    lambda index: PALETTE[index]
)


def hsv_bin(colour: tuple[int, int, int]) -> tuple[int, int, int]:
    hue, saturation, value = colorsys.rgb_to_hsv(*(c / 255 for c in colour))
    return int(hue * 8), int(saturation * 255 / 64), int(value * 255 / 64)


def jump(clip: Clip, t: int) -> float:
    """Compute J(t) from Counters of binned pixels."""
    _, height, width, _ = clip.shape
    jumps = []
    for i in range(4):
        for j in range(4):
            rows = slice(i * height // 4, (i + 1) * height // 4)
            columns = slice(j * width // 4, (j + 1) * width // 4)
            counts = []
            for first in (t - 3, t):
                tile = clip[first : first + 3, rows, columns].reshape(-1, 3).tolist()
                counts.append(Counter(hsv_bin((c[0], c[1], c[2])) for c in tile))
                pixels = len(tile)
            bins = counts[0].keys() | counts[1].keys()
            change = sum(abs(counts[0][b] - counts[1][b]) for b in bins)
            jumps.append(0.5 * change / pixels)
    return max(jumps)


def dark(count: int) -> Clip:
    return np.zeros((count, 8, 8, 3), dtype=np.uint8)


@settings(max_examples=15, deadline=None)
@given(pred=CLIPS, ref=CLIPS)
def test_excess_agrees_with_counted_pixels(pred: Clip, ref: Clip) -> None:
    excess = [max(jump(pred, t) - jump(ref, t), 0.0) for t in range(3, 6)]
    assert curve(pred, ref).tolist() == pytest.approx(excess, abs=1e-12)
    assert anomaly_excess(pred, ref) == pytest.approx(max(excess), abs=1e-12)
    assert anomaly(pred, ref) == float(anomaly_excess(pred, ref) > 0.25)


def test_lasting_change_of_one_tile_is_a_full_jump() -> None:
    pred = dark(8)
    pred[4:, :2, :2] = (255, 0, 0)
    # The windows around t = 3, 4, 5 differ in 2, 3, 2 of 3 frames.
    assert curve(pred, dark(8)).tolist() == pytest.approx([2 / 3, 1.0, 2 / 3])
    assert anomaly_excess(pred, dark(8)) == 1.0
    assert anomaly(pred, dark(8)) == 1.0


def test_flash_of_one_frame_is_a_third_of_a_jump() -> None:
    pred = dark(9)
    pred[4] = 255
    assert anomaly_excess(pred, dark(9)) == pytest.approx(1 / 3)


def test_jump_that_the_reference_shares_is_no_excess() -> None:
    pred, ref = dark(8), dark(8)
    pred[4:, :2, :2] = (255, 0, 0)
    ref[4:, 6:, 6:] = (0, 255, 0)
    assert anomaly_excess(pred, ref) == 0.0
    assert anomaly(pred, ref) == 0.0


def test_jump_that_the_prediction_misses_is_no_excess() -> None:
    ref = dark(8)
    ref[4:] = 255
    assert anomaly_excess(dark(8), ref) == 0.0


def test_clip_is_anomalous_only_above_a_quarter() -> None:
    at, above = dark(8), dark(8)
    at[4:, 0, 0] = 255
    above[4:, 0, 0] = 255
    above[5:, 0, 1] = 255
    assert anomaly_excess(at, dark(8)) == 0.25
    assert anomaly(at, dark(8)) == 0.0
    assert anomaly_excess(above, dark(8)) > 0.25
    assert anomaly(above, dark(8)) == 1.0


@pytest.mark.parametrize("count", [1, 2, 5])
def test_clips_below_six_frames_have_no_jump(count: int) -> None:
    pred = dark(count)
    pred[count // 2 :] = 255
    assert curve(pred, dark(count)).shape == (0,)
    assert anomaly_excess(pred, dark(count)) == 0.0
    assert anomaly(pred, dark(count)) == 0.0


def test_six_frames_have_one_time() -> None:
    pred = dark(6)
    pred[3:] = 255
    assert curve(pred, dark(6)).tolist() == [1.0]


def test_two_still_clips_have_no_anomaly() -> None:
    pred = dark(8)
    pred[:] = 200
    assert anomaly_excess(pred, dark(8)) == 0.0
