"""MSE: squared difference of the pixel values."""

from typing import Final

import cv2
import numpy as np

from mpmworlds.metrics.begun import bound_of_mean
from mpmworlds.metrics.clips import Clip, Curve
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.view import View, compared


def curve(pred: Clip | View, ref: Clip | View) -> Curve:
    """Compute the mean squared RGB difference of every frame.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float64 array, shape (T,)
        Mean over pixels and channels of `((p - r) / 255) ** 2`, in [0, 1].

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    one, other = compared(pred, ref)
    sums = [
        cv2.norm(p, r, cv2.NORM_L2SQR)
        for p, r in zip(one.clip, other.clip, strict=True)
    ]
    return np.asarray(np.divide(sums, one.clip[0].size * 255**2))


def mse(pred: Clip | View, ref: Clip | View) -> float:
    """Compute the mean squared RGB difference (MSE); down is better.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float
        In [0, 1]: mean over frames, pixels and channels of `((p - r) / 255) ** 2`.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape.
    """
    return float(curve(pred, ref).mean())


MSE: Final = Metric(
    mse,
    curve,
    direction="down",
    worst=1.0,
    best=0.0,
    column=7,
    paper_name="MSE",
    bound=bound_of_mean(curve),
)
