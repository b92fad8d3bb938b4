"""Anomaly: sudden jumps of colour that the reference does not have."""

from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import Clip, Curve, Indices
from mpmworlds.metrics.constants import Constants
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.tiles import tile_sizes
from mpmworlds.metrics.view import View, compared

HUE_LEVELS = 180  # 8-bit hue counts steps of 2 degrees: 0..179
Jumps = npt.NDArray[np.float64]


def _bins(view: View) -> tuple[Indices, int]:
    """HSV bin of each distinct colour by OpenCV's 8-bit HSV; number of bins."""
    hues = view.constants.anomaly_hue_bins
    saturations = view.constants.anomaly_saturation_bins
    values = view.constants.anomaly_value_bins
    shifts = np.array([16, 8, 0], np.uint32)
    rgb = (view.colours[:, None] >> shifts & 255).astype(np.uint8)[None]
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)[0] if rgb.size else rgb[0]
    hue, saturation, value = hsv.astype(np.intp).T
    hue = np.minimum(hue * hues // HUE_LEVELS, hues - 1)
    bins = (hue * saturations + saturation * saturations // 256) * values
    return bins + value * values // 256, hues * saturations * values


def _jumps(view: View) -> tuple[Jumps, Jumps]:
    """Local jumps J_w(t, r) and colour jumps K(t) for t = 1 .. T - 1.

    Returns
    -------
    local : float64 array, shape (2, T - 1, 16)
        One layer per window; 0 where it has no value, being too near to an end.
    colour : float64 array, shape (T - 1,)
        Over the whole image.
    """
    constants, count = view.constants, view.shape[0]
    counts = view.histogram(*_bins(view))
    inside = counts.sum(axis=2)
    background = tile_sizes(*view.shape[1:], constants.tiles_per_side) - inside
    tiles = np.concatenate([counts, background[..., None]], axis=2)
    local = np.zeros((len(constants.anomaly_windows), count - 1, inside.shape[1]))
    for layer, window in zip(local, constants.anomaly_windows, strict=True):
        if count >= 2 * window:
            change = _difference_across(tiles, window).sum(axis=2) / 2
            larger = _larger_across(inside, window)
            # Both are sums over the frames of a window: its length cancels but here.
            allowance = window * constants.anomaly_local_px
            layer[window - 1 : count - window] = change / (larger + allowance)
    areas = counts.sum(axis=1)
    larger = np.maximum(areas[1:], areas[:-1]) + constants.anomaly_colour_px
    return local, (np.abs(np.diff(areas, axis=0)) / larger).max(axis=1)


def _windows(values: npt.NDArray[np.int64], window: int) -> npt.NDArray[np.int64]:
    """Sums over frames t .. t + window - 1."""
    span = len(values) - window + 1
    return np.asarray(np.sum([values[k : k + span] for k in range(window)], axis=0))


def _difference_across(
    values: npt.NDArray[np.int64], window: int
) -> npt.NDArray[np.int64]:
    """How much the sums before and from each time on differ."""
    sums = _windows(values, window)
    return np.asarray(np.abs(sums[window:] - sums[:-window]))


def _larger_across(values: npt.NDArray[np.int64], window: int) -> npt.NDArray[np.int64]:
    """The larger of the sums before and from each time on."""
    sums = _windows(values, window)
    return np.maximum(sums[window:], sums[:-window])


def _largest_near(values: Jumps, reach: int, axis: int) -> Jumps:
    """The largest value among those up to `reach` away along an axis; all are >= 0."""
    if not values.size:
        return values
    widths = [(0, 0)] * values.ndim
    widths[axis] = (reach, reach)
    views = np.lib.stride_tricks.sliding_window_view(
        np.pad(values, widths), 2 * reach + 1, axis=axis
    )
    return np.asarray(views.max(axis=-1))


def _excused(view: View) -> tuple[Jumps, Jumps]:
    """What the reference excuses: its largest jumps near by, of `_jumps`."""
    local, colour = view.once(_jumps)
    slack, side = view.constants.anomaly_slack, view.constants.tiles_per_side
    grid = local.reshape(*local.shape[:2], side, side)
    for axis, reach in ((1, slack), (2, 1), (3, 1)):
        grid = _largest_near(grid, reach, axis)
    return grid.reshape(local.shape), _largest_near(colour, slack, 0)


def curve(pred: Clip | View, ref: Clip | View) -> Curve:
    """Compute the excess jump at every time.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float64 array, shape (T - 1,)
        e(t), in [0, 1]. Entry k belongs to t = k + 1, from frame k to frame k + 1.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    one, other = compared(pred, ref)
    local, colour = one.once(_jumps)
    excused, excused_colour = other.once(_excused)
    largest = np.maximum((local - excused).max(axis=(0, 2)), colour - excused_colour)
    return np.asarray(np.maximum(largest, 0.0))


def anomaly_excess(pred: Clip | View, ref: Clip | View) -> float:
    """Compute the largest jump beyond the reference's; down is better.

    Two jumps are looked at. The local one, per tile (4 x 4) and window w of 1 or 3
    frames, is half the L1 distance between the mean HSV histogram (8 x 4 x 4 bins of
    the foreground, one for the background) of the w frames before t and that of the w
    frames from t on, over 64 and the larger mean number of foreground pixels of the
    two. The colour jump is the largest relative change of the area of an HSV bin in the
    whole image, `|A(t) - A(t-1)| / (max(A(t), A(t-1)) + 200)`. The reference excuses
    its own largest jump within t - 4 .. t + 4, a local one also of the 8 tiles around:
    what is a little early or beside is no anomaly.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float
        In [0, 1]: the largest excess e(t) over times, tiles, windows and both kinds; 0
        for a single frame.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    return float(curve(pred, ref).max(initial=0.0))


def flag(excess: float, constants: Constants) -> float:
    """Return 1 if an excess jump makes a clip anomalous, else 0."""
    return float(excess > constants.anomaly_excess)


def anomaly(pred: Clip | View, ref: Clip | View) -> float:
    """Compute whether a clip jumps where its reference does not (RTSJ).

    Down is better; the mean over samples is the anomaly rate.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float
        1 if `anomaly_excess` is above 0.55, else 0.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    one, other = compared(pred, ref)
    return flag(anomaly_excess(one, other), one.constants)


ANOMALY: Final = Metric(
    anomaly,
    curve,
    direction="down",
    worst=1.0,
    best=0.0,
    column=5,
    paper_name="RTSJ",
    anchored=True,
)
ANOMALY_EXCESS: Final = Metric(
    anomaly_excess,
    curve,
    direction="down",
    worst=1.0,
    best=0.0,
    column=9,
    selected_by="anomaly",
)
