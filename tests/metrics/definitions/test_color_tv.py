"""Colour histograms of foregrounds."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mpmworlds.metrics import color_tv
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.definitions.color_tv import curve

LEVELS = st.sampled_from([0, 31, 32, 33, 63, 64, 128, 224, 255])
CLIPS = arrays(np.uint8, (2, 4, 5, 3), elements=LEVELS)
RED, BLUE = (255, 0, 0), (0, 0, 255)


def row(*colours: tuple[int, int, int]) -> Clip:
    clip = np.zeros((1, 4, 4, 3), dtype=np.uint8)
    clip[0, 2, : len(colours)] = colours
    return clip


def shares(frame: Clip) -> dict[tuple[int, ...], float]:
    pixels = [c for c in frame.reshape(-1, 3).tolist() if max(c) > 32]
    counts = Counter(tuple(int(v / 32) for v in c) for c in pixels)
    return {colour: count / len(pixels) for colour, count in counts.items()}


def test_distance_of_disjoint_colours_is_one() -> None:
    assert color_tv(row(RED, RED), row(BLUE, BLUE)) == 1.0


def test_distance_is_the_share_of_pixels_that_changed_colour() -> None:
    assert color_tv(row(RED, RED, RED, BLUE), row(RED, RED, RED, RED)) == 0.25


def test_distance_does_not_depend_on_the_number_of_pixels() -> None:
    black = (0, 0, 0)
    pred, ref = row(RED, BLUE, black, black), row(RED, RED, BLUE, BLUE)
    assert color_tv(pred, ref) == 0.0


def test_bins_are_32_levels_wide() -> None:
    assert color_tv(row((64, 128, 255)), row((95, 159, 224))) == 0.0
    assert color_tv(row((64, 128, 255)), row((63, 128, 255))) == 1.0


def test_two_empty_foregrounds_are_equal_and_one_is_farthest() -> None:
    clip = np.zeros((2, 4, 4, 3), dtype=np.uint8)
    other = clip.copy()
    other[1, 0, 0] = RED
    assert curve(clip, other).tolist() == [0.0, 1.0]
    assert curve(other, clip).tolist() == [0.0, 1.0]


@settings(max_examples=50, deadline=None)
@given(pred=CLIPS, ref=CLIPS)
def test_distance_agrees_with_counted_colours(pred: Clip, ref: Clip) -> None:
    for value, p, r in zip(curve(pred, ref), pred, ref, strict=True):
        h_p, h_r = shares(p), shares(r)
        total = sum(abs(h_p.get(c, 0) - h_r.get(c, 0)) for c in h_p.keys() | h_r.keys())
        one_empty = bool(h_p) != bool(h_r)
        assert value == pytest.approx(1.0 if one_empty else total / 2, abs=1e-12)
