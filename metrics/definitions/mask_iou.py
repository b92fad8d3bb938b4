"""Mask IoU: overlap of the two foregrounds."""

from typing import Final

import numpy as np

from mpmworlds.metrics.begun import first
from mpmworlds.metrics.clips import Clip, Curve
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.view import View, compared, true_in_each


def curve(pred: Clip | View, ref: Clip | View) -> Curve:
    """Compute the foreground overlap of every frame.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float64 array, shape (T,)
        `|M_p & M_r| / |M_p | M_r|` per frame; 1 where both masks are empty.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    one, other = compared(pred, ref)
    common = true_in_each(one.mask & other.mask)
    either = one.sizes + other.sizes - common
    return np.where(either == 0, 1.0, common / np.maximum(either, 1))


def mask_iou(pred: Clip | View, ref: Clip | View) -> float:
    """Compute the mean foreground overlap (mIoU); up is better.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float
        In [0, 1]: mean over frames of `|M_p & M_r| / |M_p | M_r|`, where a frame with
        two empty masks counts 1.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    return float(curve(pred, ref).mean())


def _bound(begun: View, ref: View) -> float:
    """All of what is to come may fit."""
    known, total = begun.shape[0], ref.shape[0]
    return float((curve(begun, first(ref, known)).sum() + total - known) / total)


MASK_IOU: Final = Metric(
    mask_iou,
    curve,
    direction="up",
    worst=0.0,
    best=1.0,
    column=0,
    paper_name="mIoU",
    anchored=True,
    bound=_bound,
)
