"""Colour TV: total variation between foreground colour histograms."""

from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.begun import bound_of_mean
from mpmworlds.metrics.clips import Clip, Curve, rgb_bins
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.view import View, compared


def _histograms(view: View) -> npt.NDArray[np.int64]:
    """Count the foreground pixels of each frame per RGB bin: `(T, 512)`."""
    per_channel = view.constants.color_tv_bins
    bins = rgb_bins(view.colours, per_channel)
    return np.asarray(view.histogram(bins, per_channel**3).sum(axis=1))


def curve(pred: Clip | View, ref: Clip | View) -> Curve:
    """Compute the colour difference of every frame.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float64 array, shape (T,)
        `0.5 * sum |h_p - h_r|` per frame, in [0, 1], where h is the normalised
        8 x 8 x 8 RGB histogram of the foreground; 0 where both foregrounds are empty,
        1 where one is.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    one, other = compared(pred, ref)
    share_p, share_r = (
        view.once(_histograms) / np.maximum(view.sizes, 1)[:, None]
        for view in (one, other)
    )
    distance = 0.5 * np.abs(share_p - share_r).sum(axis=1)
    # One empty histogram leaves half of the total variation: it counts 1 instead.
    one_empty = (one.sizes == 0) != (other.sizes == 0)
    return np.where(one_empty, 1.0, np.minimum(distance, 1.0))


def color_tv(pred: Clip | View, ref: Clip | View) -> float:
    """Compute the mean colour difference of the foregrounds (CTV); down is better.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    float
        In [0, 1]: mean over frames of `0.5 * sum |h_p - h_r|` for the normalised
        8 x 8 x 8 RGB histograms h of the foreground; a frame counts 0 when both
        foregrounds are empty and 1 when one is.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    return float(curve(pred, ref).mean())


COLOR_TV: Final = Metric(
    color_tv,
    curve,
    direction="down",
    worst=1.0,
    best=0.0,
    column=4,
    paper_name="CTV",
    anchored=True,
    bound=bound_of_mean(curve),
)
