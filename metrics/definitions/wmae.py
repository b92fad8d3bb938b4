"""Windowed MAE: difference between where and when two clips move."""

from itertools import pairwise
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import Clip, Curve
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.tiles import tile_of_pixel, tile_sizes
from mpmworlds.metrics.view import View, compared, some_above


def _tile_changes(view: View) -> Curve:
    """Sum the changes of luma beyond the dead band over each tile: `(T - 1, 16)`.

    They are in thousandths of a level, whole numbers whose sums stay below 2**53: every
    value is exact, whatever the order of summation. A pixel that changes by no more
    than the dead band in any channel does not in luma either, so that few are looked
    at.
    """
    count, height, width = view.shape
    side, band = view.constants.tiles_per_side, view.constants.wmae_dead_band
    tile = tile_of_pixel(height, width, side).ravel()
    weights = np.array(view.constants.wmae_luma, np.int32)
    sums = np.zeros((count - 1, side**2))
    steps = list(pairwise(view.clip))
    changed = some_above((cv2.absdiff(*step) for step in steps), band)
    for t, ((before, after), some) in enumerate(zip(steps, changed, strict=True)):
        place = np.flatnonzero(some)
        change = after.reshape(-1, 3)[place].astype(np.int32)
        change -= before.reshape(-1, 3)[place]
        luma = np.abs(change @ weights)
        luma[luma <= band * weights.sum()] = 0
        sums[t] = np.bincount(tile[place], weights=luma, minlength=side**2)
    return sums


def _moving_average(values: Curve, window: int) -> Curve:
    """Average over frames t - 4 .. t + 3 for a window of 8, as far as they exist."""
    count = values.shape[0]
    first = np.maximum(np.arange(count) - window // 2, 0)
    last = np.minimum(np.arange(count) - window // 2 + window, count)
    sums = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])


def _activity(view: View) -> Curve:
    """Compute the smoothed activity A(t, r) of every tile: `(T - 1, 16)`."""
    full_scale = 255 * sum(view.constants.wmae_luma)
    pixels = tile_sizes(*view.shape[1:], view.constants.tiles_per_side)
    if view.shape[0] == 1:
        return np.zeros((0, pixels.size))
    smooth = _moving_average(_tile_changes(view), view.constants.wmae_window)
    return smooth / (pixels * full_scale)


def _difference_and_total(
    pred: Clip | View, ref: Clip | View
) -> tuple[Curve, Curve, float]:
    """Sum |A_p - A_r| and A_p + A_r over the tiles, `(T - 1,)` each; and epsilon."""
    one, other = compared(pred, ref)
    active_p, active_r = one.once(_activity), other.once(_activity)
    difference: npt.NDArray[np.float64] = np.abs(active_p - active_r).sum(axis=1)
    total = (active_p + active_r).sum(axis=1)
    return difference, total, one.constants.wmae_epsilon


def curve(pred: Clip | View, ref: Clip | View) -> Curve:
    """Compute the motion difference at every time (moving W-MAE).

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float64 array, shape (T - 1,)
        `sum |A_p - A_r| / (sum (A_p + A_r) + 1e-8)` with sums over the tiles, in
        [0, 1]. Entry t belongs to the step from frame t to frame t + 1.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    difference, total, epsilon = _difference_and_total(pred, ref)
    return difference / (total + epsilon)


def wmae(pred: Clip | View, ref: Clip | View) -> float:
    """Compute the difference in motion activity (W-MAE); down is better.

    The activity A(t, r) of a clip is the mean over tile r (4 x 4 equal tiles) of
    `|Y(t + 1) - Y(t)|` where that exceeds 24/255, Y the BT.601 luma in [0, 1], smoothed
    over the 8 steps t - 4 .. t + 3 (at the ends: over those that exist). Smaller
    changes are noise of sensors and codecs.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float
        In [0, 1]: `sum |A_p - A_r| / (sum (A_p + A_r) + 1e-8)` over all t and r; 0 when
        both clips are still, and hence for clips of a single frame. A still prediction
        of a moving reference scores 1, whatever the motion.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    difference, total, epsilon = _difference_and_total(pred, ref)
    return float(difference.sum() / (total.sum() + epsilon))


def _bound(begun: View, ref: View) -> float:
    """All later motion may be that of the reference.

    If a step adds more or less motion than the reference has, the quotient only grows,
    as it is at most 1. Of the steps that are known, the last ones are not smooth yet.
    """
    known = max(begun.shape[0] - 1 - (begun.constants.wmae_window - 1) // 2, 0)
    active_p, active_r = begun.once(_activity)[:known], ref.once(_activity)
    difference = np.abs(active_p - active_r[:known]).sum()
    total = active_p.sum() + active_r[:known].sum() + 2 * active_r[known:].sum()
    return float(difference / (total + ref.constants.wmae_epsilon))


WMAE: Final = Metric(
    wmae,
    curve,
    direction="down",
    worst=1.0,
    best=0.0,
    column=3,
    paper_name="W-MAE",
    anchored=True,
    bound=_bound,
)
