"""What a clip is: validation at the boundary, and its foreground."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.constants import CONSTANTS

Clip: TypeAlias = npt.NDArray[np.uint8]
"""``uint8 (T, H, W, 3)``, RGB."""
Mask: TypeAlias = npt.NDArray[np.bool_]
"""``bool (T, H, W)``, true on the foreground."""
Curve: TypeAlias = npt.NDArray[np.float64]
"""``float64 (K,)``, one value per frame or per time."""


def check_clip(clip: Clip, subject: str = "clip") -> None:
    """Raise unless an array is a clip.

    Parameters
    ----------
    clip : uint8 array, shape (T, H, W, 3)
        Frames, RGB; T, H and W are at least 1.
    subject : str
        What the error calls the array.

    Raises
    ------
    ValueError
        If the type, the number of axes, the channels or the extent is wrong.
    """
    if not isinstance(clip, np.ndarray):
        raise ValueError(
            f"{subject}: {type(clip).__name__}, must be a numpy array uint8 "
            "(T, H, W, 3); convert it with numpy.asarray"
        )
    if (
        clip.dtype != np.uint8
        or clip.ndim != 4
        or clip.shape[3] != 3
        or 0 in clip.shape
    ):
        raise ValueError(
            f"{subject}: {clip.dtype} {clip.shape}, must be uint8 (T, H, W, 3) with "
            "T, H, W >= 1; decode the video to RGB bytes"
        )


def check_pair(pred: Clip, ref: Clip) -> None:
    """Raise unless two arrays are clips of equal shape.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB.

    Raises
    ------
    ValueError
        If either is no clip, or if their shapes differ (the message names both).
    """
    check_clip(pred, "prediction")
    check_clip(ref, "reference")
    if pred.shape != ref.shape:
        raise ValueError(
            f"prediction {pred.shape} and reference {ref.shape}: compared clips must "
            "have equal shapes; bring both to one size, frame rate and duration"
        )


def foreground(clip: Clip) -> Mask:
    """Return which pixels are foreground: ``max(R, G, B) > 32``.

    Parameters
    ----------
    clip : uint8 array, shape (T, H, W, 3)
        Frames, RGB.

    Returns
    -------
    bool array, shape (T, H, W)
        True on the foreground.
    """
    red_green = np.maximum(clip[..., 0], clip[..., 1])
    return np.maximum(red_green, clip[..., 2]) > CONSTANTS.foreground_level


def packed_colours(clip: Clip) -> npt.NDArray[np.uint32]:
    """Pack RGB into one number, ``R << 16 | G << 8 | B``: ``(T, H, W)``."""
    packed = clip[..., 0].astype(np.uint32)
    for channel in (1, 2):
        packed <<= 8
        packed |= clip[..., channel]
    return packed
