"""Anomaly: sudden local colour jumps that the reference does not have."""

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import Clip, Curve, check_pair
from mpmworlds.metrics.constants import CONSTANTS
from mpmworlds.metrics.tiles import tile_of_pixel, tile_sizes, tile_starts

HUE_LEVELS = 180
"""8-bit hue counts steps of 2 degrees: 0..179."""


def _bin_table() -> npt.NDArray[np.uint8]:
    """Map 8-bit H, S and V to their shares of the bin number: ``(1, 256, 3)``."""
    hues = CONSTANTS.anomaly_hue_bins
    saturations = CONSTANTS.anomaly_saturation_bins
    values = CONSTANTS.anomaly_value_bins
    level = np.arange(256)
    hue = np.minimum(level * hues // HUE_LEVELS, hues - 1) * saturations * values
    saturation = level * saturations // 256 * values
    value = level * values // 256
    return np.stack([hue, saturation, value], axis=-1)[None].astype(np.uint8)


def _tile_histograms(clip: Clip) -> npt.NDArray[np.int64]:
    """Count the pixels of each tile per HSV bin: ``(T, 16, 128)``."""
    bins = (
        CONSTANTS.anomaly_hue_bins
        * CONSTANTS.anomaly_saturation_bins
        * CONSTANTS.anomaly_value_bins
    )
    height, width = clip.shape[1:3]
    tiles = CONSTANTS.tiles_per_side**2
    table = _bin_table()
    offset = tile_of_pixel(height, width) * bins
    counts = np.empty((clip.shape[0], tiles, bins), dtype=np.int64)
    for t, frame in enumerate(clip):
        hsv = cv2.cvtColor(np.ascontiguousarray(frame), cv2.COLOR_RGB2HSV)
        parts = cv2.LUT(hsv, table)
        code = offset + parts[..., 0] + parts[..., 1] + parts[..., 2]
        counts[t] = np.bincount(code.ravel(), minlength=tiles * bins).reshape(
            tiles, bins
        )
    return counts


def _jumps(clip: Clip) -> Curve:
    """Compute J(t), the largest tile jump, for t = 3 .. T - 3."""
    window = CONSTANTS.anomaly_window
    count, height, width, _ = clip.shape
    if count < 2 * window:
        tile_starts(min(height, width))
        return np.zeros(0)
    histograms = _tile_histograms(clip)
    span = count - window + 1
    sums = np.sum([histograms[k : k + span] for k in range(window)], axis=0)
    changed = np.abs(sums[window:] - sums[:-window]).sum(axis=2)
    # Each tile holds `window` normalised histograms of as many pixels, on both sides.
    jump = changed / (2 * window * tile_sizes(height, width))
    return np.asarray(jump.max(axis=1))


def curve(pred: Clip, ref: Clip) -> Curve:
    """Compute the excess jump at every time.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float64 array, shape (max(T - 5, 0),)
        ``e(t) = max(J_p(t) - J_r(t), 0)``, in [0, 1]. Entry k belongs to t = k + 3:
        only times with 3 frames before and 3 from t on have a value.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    check_pair(pred, ref)
    return np.maximum(_jumps(pred) - _jumps(ref), 0.0)


def anomaly_excess(pred: Clip, ref: Clip) -> float:
    """Compute the largest colour jump beyond the reference's; down is better.

    Per tile (4 x 4) and time, J(t, r) is the total variation between the mean HSV
    histogram (8 x 4 x 4 bins, all pixels) of the 3 frames before t and that of the 3
    frames from t on; J(t) is its largest value over the tiles.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float
        In [0, 1]: ``max_t max(J_p(t) - J_r(t), 0)``; 0 for clips below 6 frames,
        which have no time with 3 frames on both sides.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    return float(curve(pred, ref).max(initial=0.0))


def flag(excess: float) -> float:
    """Return 1 if an excess jump makes a clip anomalous, else 0.

    Parameters
    ----------
    excess : float
        Value of `anomaly_excess`.

    Returns
    -------
    float
        1 if ``excess > 0.25``, else 0.
    """
    return float(excess > CONSTANTS.anomaly_excess)


def anomaly(pred: Clip, ref: Clip) -> float:
    """Compute whether a clip jumps where its reference does not (RTSJ).

    Down is better; the mean over samples is the anomaly rate.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float
        1 if `anomaly_excess` is above 0.25, else 0.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    return flag(anomaly_excess(pred, ref))
