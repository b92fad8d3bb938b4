"""Colour TV: total variation between foreground colour histograms."""

import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import Clip, Curve, check_pair, foreground
from mpmworlds.metrics.constants import CONSTANTS


def _histograms(clip: Clip) -> npt.NDArray[np.int64]:
    """Count the foreground pixels of each frame per RGB bin: ``(T, 512)``."""
    per_channel = CONSTANTS.color_tv_bins
    bins = per_channel**3
    shift = (256 // per_channel).bit_length() - 1
    code = np.zeros(clip.shape[:3], dtype=np.uint16)
    for channel in range(3):
        code *= per_channel
        code += clip[..., channel] >> shift
    counts = [
        np.bincount(frame[inside], minlength=bins)
        for frame, inside in zip(code, foreground(clip), strict=True)
    ]
    return np.stack(counts)


def curve(pred: Clip, ref: Clip) -> Curve:
    """Compute the colour difference of every frame.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float64 array, shape (T,)
        ``0.5 * sum |h_p - h_r|`` per frame, in [0, 1], where h is the normalised
        8 x 8 x 8 RGB histogram of the foreground; 0 where both foregrounds are empty,
        1 where one is.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    check_pair(pred, ref)
    counts_p, counts_r = _histograms(pred), _histograms(ref)
    total_p, total_r = counts_p.sum(axis=1), counts_r.sum(axis=1)
    share_p = counts_p / np.maximum(total_p, 1)[:, None]
    share_r = counts_r / np.maximum(total_r, 1)[:, None]
    distance = 0.5 * np.abs(share_p - share_r).sum(axis=1)
    # One empty histogram leaves half of the total variation: it counts 1 instead.
    return np.where((total_p == 0) != (total_r == 0), 1.0, np.minimum(distance, 1.0))


def color_tv(pred: Clip, ref: Clip) -> float:
    """Compute the mean colour difference of the foregrounds (CTV); down is better.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float
        In [0, 1]: mean over frames of ``0.5 * sum |h_p - h_r|`` for the normalised
        8 x 8 x 8 RGB histograms h of the foreground; a frame counts 0 when both
        foregrounds are empty and 1 when one is.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    return float(curve(pred, ref).mean())
