"""Windowed MAE: difference between where and when two clips move."""

import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import Clip, Curve, check_pair
from mpmworlds.metrics.constants import CONSTANTS
from mpmworlds.metrics.tiles import tile_sizes, tile_starts


def _tile_changes(clip: Clip) -> Curve:
    """Sum |Y(t+1) - Y(t)| over each tile: ``(T - 1, 16)`` [luma / 255000].

    Luma in thousandths of a level is a whole number below 2**24 and its sums stay
    below 2**53: every value here is exact, whatever the order of summation.
    """
    count, height, width, _ = clip.shape
    rows, columns = tile_starts(height), tile_starts(width)
    weights = np.array(CONSTANTS.wmae_luma, dtype=np.float32)
    sums = np.empty((count - 1, rows.size * columns.size))
    before = clip[0].astype(np.float32) @ weights
    for t in range(count - 1):
        after = clip[t + 1].astype(np.float32) @ weights
        change = np.abs(after - before)
        strips = np.add.reduceat(change, rows, axis=0, dtype=np.float64)
        sums[t] = np.add.reduceat(strips, columns, axis=1).ravel()
        before = after
    return sums


def _moving_average(values: Curve) -> Curve:
    """Average over frames t - 4 .. t + 3, as far as they exist."""
    count = values.shape[0]
    half = CONSTANTS.wmae_window // 2
    first = np.maximum(np.arange(count) - half, 0)
    last = np.minimum(np.arange(count) - half + CONSTANTS.wmae_window, count)
    sums = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])


def _activity(clip: Clip) -> Curve:
    """Compute the smoothed activity A(t, r) of every tile: ``(T - 1, 16)``."""
    if clip.shape[0] == 1:
        return np.zeros((0, CONSTANTS.tiles_per_side**2))
    full_scale = 255 * sum(CONSTANTS.wmae_luma)
    pixels = tile_sizes(clip.shape[1], clip.shape[2])
    return _moving_average(_tile_changes(clip)) / (pixels * full_scale)


def _difference_and_total(pred: Clip, ref: Clip) -> tuple[Curve, Curve]:
    """Sum |A_p - A_r| and A_p + A_r over the tiles: two arrays ``(T - 1,)``."""
    check_pair(pred, ref)
    tile_starts(min(pred.shape[1:3]))
    active_p, active_r = _activity(pred), _activity(ref)
    difference: npt.NDArray[np.float64] = np.abs(active_p - active_r).sum(axis=1)
    return difference, (active_p + active_r).sum(axis=1)


def curve(pred: Clip, ref: Clip) -> Curve:
    """Compute the motion difference at every time (moving W-MAE).

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float64 array, shape (T - 1,)
        ``sum |A_p - A_r| / (sum (A_p + A_r) + 1e-8)`` with sums over the tiles, in
        [0, 1]. Entry t belongs to the step from frame t to frame t + 1.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    difference, total = _difference_and_total(pred, ref)
    return difference / (total + CONSTANTS.wmae_epsilon)


def wmae(pred: Clip, ref: Clip) -> float:
    """Compute the difference in motion activity (W-MAE); down is better.

    The activity A(t, r) of a clip is the mean over tile r (4 x 4 equal tiles) of
    ``|Y(t + 1) - Y(t)|``, Y the BT.601 luma in [0, 1], smoothed over the 8 steps
    t - 4 .. t + 3 (at the ends: over those that exist).

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float
        In [0, 1]: ``sum |A_p - A_r| / (sum (A_p + A_r) + 1e-8)`` over all t and r;
        0 when both clips are still, and hence for clips of a single frame.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    difference, total = _difference_and_total(pred, ref)
    return float(difference.sum() / (total.sum() + CONSTANTS.wmae_epsilon))
