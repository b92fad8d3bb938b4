"""What a clip is: validation at the boundary."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Clip: TypeAlias = npt.NDArray[np.uint8]
"""`uint8 (T, H, W, 3)`, RGB."""
Mask: TypeAlias = npt.NDArray[np.bool_]
"""True on the foreground."""
Curve: TypeAlias = npt.NDArray[np.float64]
"""`float64 (K,)`, one value per frame or time; the last belongs to the last frame."""
Colours: TypeAlias = npt.NDArray[np.uint32]
"""`R << 16 | G << 8 | B`."""
Indices: TypeAlias = npt.NDArray[np.intp]


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
    if isinstance(clip, np.ma.MaskedArray):
        raise ValueError(
            f"{subject}: a masked array, must be a plain one, for every pixel counts; "
            "fill it with clip.filled(0)"
        )
    if (
        clip.dtype != np.uint8
        or clip.ndim != 4
        or clip.shape[3:] != (3,)
        or not clip.size
    ):
        raise ValueError(
            f"{subject}: {clip.dtype} {clip.shape}, must be uint8 (T, H, W, 3) with "
            f"T, H, W >= 1; {_remedy(clip)}"
        )


def _remedy(clip: npt.NDArray[np.generic]) -> str:
    """What to do with an array that is no clip, but perhaps nearly one."""
    if clip.ndim != 4 or not clip.size:
        return "decode the video to RGB bytes"
    if clip.shape[3] != 3:
        if clip.shape[1] == 3:
            return "put the channels last with clip.transpose(0, 2, 3, 1)"
        if clip.shape[3] == 4:
            return "leave out the alpha channel with clip[..., :3]"
    elif clip.dtype.kind in "iuf":
        low, high = clip.min(), clip.max()
        if not np.isfinite([low, high]).all():
            return "it has values that are not finite; mend what makes it"
        if clip.dtype.kind == "f" and low >= 0 and high <= 1:
            return "multiply by 255 and round"
        if low >= 0 and high <= 255:
            return "round it and convert it with clip.astype(numpy.uint8)"
    return "decode the video to RGB bytes"


def packed_colours(clip: Clip) -> Colours:
    """Pack RGB into one number, `R << 16 | G << 8 | B`: `(T, H, W)`."""
    packed = clip[..., 0].astype(np.uint32)
    for channel in (1, 2):
        packed <<= 8
        packed |= clip[..., channel]
    return packed


def rgb_bins(colours: Colours, per_channel: int) -> Indices:
    """Number the RGB bins that colours lie in, of so many per channel (a power of two).

    Parameters
    ----------
    colours : uint32 array, shape (N,)
        `R << 16 | G << 8 | B`.
    per_channel : int
        Bins per channel.

    Returns
    -------
    int array, shape (N,)
        Below `per_channel ** 3`.
    """
    shift = (256 // per_channel).bit_length() - 1
    bins = np.zeros(colours.shape, np.intp)
    for channel in (16, 8, 0):
        bins = bins * per_channel + ((colours >> channel & 255) >> shift)
    return bins
