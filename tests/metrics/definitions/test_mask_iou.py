"""Overlap of foregrounds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from sklearn.metrics import jaccard_score

from mpmworlds.metrics import mask_iou
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.definitions.mask_iou import curve

CLIPS = arrays(np.uint8, (2, 4, 4, 3), elements=st.sampled_from([0, 32, 33, 255]))


def bars(*columns: slice) -> Clip:
    """Paint one bar per frame on 4 x 8 px."""
    clip = np.zeros((len(columns), 4, 8, 3), dtype=np.uint8)
    for frame, where in zip(clip, columns, strict=True):
        frame[:, where] = 255
    return clip


def test_iou_of_disjoint_masks_is_zero() -> None:
    assert mask_iou(bars(slice(0, 4)), bars(slice(4, 8))) == 0.0


def test_iou_of_half_shifted_bars_is_one_third() -> None:
    assert mask_iou(bars(slice(0, 4)), bars(slice(2, 6))) == 1 / 3


def test_iou_of_two_empty_masks_is_one_and_of_one_is_zero() -> None:
    empty = slice(0, 0)
    pred, ref = bars(empty, empty), bars(empty, slice(0, 3))
    assert curve(pred, ref).tolist() == [1.0, 0.0]
    assert curve(ref, pred).tolist() == [1.0, 0.0]
    assert mask_iou(pred, ref) == 0.5


def test_iou_ignores_colour() -> None:
    ref = bars(slice(0, 4))
    assert mask_iou(ref // 255 * np.uint8(40), ref) == 1.0


@settings(max_examples=50, deadline=None)
@given(pred=CLIPS, ref=CLIPS)
def test_iou_agrees_with_sets_of_pixels(pred: Clip, ref: Clip) -> None:
    values = []
    for p, r in zip(pred, ref, strict=True):
        set_p = {i for i, c in enumerate(p.reshape(-1, 3).tolist()) if max(c) > 32}
        set_r = {i for i, c in enumerate(r.reshape(-1, 3).tolist()) if max(c) > 32}
        both = set_p | set_r
        values.append(len(set_p & set_r) / len(both) if both else 1.0)
    assert curve(pred, ref).tolist() == values


def test_iou_agrees_with_the_jaccard_score_of_scikit_learn() -> None:
    random = np.random.default_rng(0)
    pred, ref = random.integers(0, 70, (2, 5, 40, 30, 3), dtype=np.uint8)
    expected = [
        jaccard_score((r.max(axis=2) > 32).ravel(), (p.max(axis=2) > 32).ravel())
        for p, r in zip(pred, ref, strict=True)
    ]
    assert curve(pred, ref).tolist() == pytest.approx(expected, abs=1e-15)
