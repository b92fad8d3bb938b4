"""MSE: squared difference of the pixel values."""

import cv2
import numpy as np

from mpmworlds.metrics.clips import Clip, Curve, check_pair


def curve(pred: Clip, ref: Clip) -> Curve:
    """Compute the mean squared RGB difference of every frame.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float64 array, shape (T,)
        Mean over pixels and channels of ``((p - r) / 255) ** 2``, in [0, 1].

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    check_pair(pred, ref)
    sums = [
        cv2.norm(np.ascontiguousarray(p), np.ascontiguousarray(r), cv2.NORM_L2SQR)
        for p, r in zip(pred, ref, strict=True)
    ]
    return np.asarray(np.divide(sums, pred[0].size * 255**2))


def mse(pred: Clip, ref: Clip) -> float:
    """Compute the mean squared RGB difference (MSE); down is better.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float
        In [0, 1]: mean over frames, pixels and channels of ``((p - r) / 255) ** 2``.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    return float(curve(pred, ref).mean())
