"""Mask IoU: overlap of the two foregrounds."""

import numpy as np

from mpmworlds.metrics.clips import Clip, Curve, check_pair, foreground


def curve(pred: Clip, ref: Clip) -> Curve:
    """Compute the foreground overlap of every frame.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float64 array, shape (T,)
        ``|M_p & M_r| / |M_p | M_r|`` per frame; 1 where both masks are empty.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    check_pair(pred, ref)
    mask_p, mask_r = foreground(pred), foreground(ref)
    common = np.count_nonzero(mask_p & mask_r, axis=(1, 2))
    either = np.count_nonzero(mask_p | mask_r, axis=(1, 2))
    return np.where(either == 0, 1.0, common / np.maximum(either, 1))


def mask_iou(pred: Clip, ref: Clip) -> float:
    """Compute the mean foreground overlap (mIoU); up is better.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float
        In [0, 1]: mean over frames of ``|M_p & M_r| / |M_p | M_r|``, where a frame
        with two empty masks counts 1.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    return float(curve(pred, ref).mean())
