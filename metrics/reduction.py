"""The one reduction of clips to the form that is evaluated, and their two halves.

References, predictions and the runs behind a noise ceiling go through the same
functions. Frames and pixels are picked,
never blended, so flat palette colours stay flat palette colours: a mean over pixels
would invent colours along every outline, and with them colour differences that no
solver made.
"""

from typing import Final

import numpy as np
import numpy.typing as npt

Frames = npt.NDArray[np.uint8]

SIDE: Final = 256  # [px]
FRAMERATE: Final = 15  # [1/s]
PREFIX_SECONDS: Final = 2.5


def reduce_clip(frames: Frames, framerate: int) -> Frames:
    """Bring a clip to at most 256 x 256 pixels and 15 frames per second.

    Output pixel i is the input pixel under its centre, floor((i + 1/2) N / 256); output
    frame k is the last input frame at or before k / 15 s. A clip that is small or slow
    enough already stays as it is.

    Parameters
    ----------
    frames
        uint8 (T, N, N, 3), RGB.
    framerate
        Its frames per second [1/s].

    Returns
    -------
    ndarray
        The reduced clip, uint8 (T', N', N', 3), at `reduced_framerate(framerate)`.

    Raises
    ------
    ValueError
        If the clip is not of that form, or the frame rate is not positive.
    """
    if frames.dtype != np.uint8 or frames.ndim != 4 or frames.shape[3] != 3:
        raise ValueError(
            f"clip is {frames.dtype} {frames.shape}, must be uint8 (T, N, N, 3)"
        )
    count, height, width, _ = frames.shape
    side = reduced_side(height, width)
    check_framerate(framerate)
    if framerate > FRAMERATE:
        kept = -(-count * FRAMERATE // framerate)
        frames = frames[np.arange(kept) * framerate // FRAMERATE]
    if height > side:
        picked = (2 * np.arange(side) + 1) * height // (2 * side)
        frames = frames[:, picked[:, None], picked]
    return frames


def reduced_side(height: int, width: int) -> int:
    """Return the pixels per side of a clip after `reduce_clip`.

    Raises
    ------
    ValueError
        If it is not square.
    """
    if height != width:
        raise ValueError(f"clip is {width} x {height} px, must be square; crop it")
    return min(height, SIDE)


def is_kept(index: int, framerate: int) -> bool:
    """Whether `reduce_clip` keeps a frame of a clip; the first one has index 0."""
    if framerate <= FRAMERATE:
        return True
    after = -(-index * FRAMERATE // framerate)  # first output frame not before it
    return after * framerate // FRAMERATE == index


def check_framerate(framerate: int) -> None:
    """Raise `ValueError` unless there is at least a frame a second."""
    if framerate < 1:
        raise ValueError(f"framerate = {framerate}, must be at least 1 frame a second")


def reduced_framerate(framerate: int) -> int:
    """Return the frames per second of a clip after `reduce_clip`."""
    return min(framerate, FRAMERATE)


def prefix_length(framerate: int) -> int:
    """Return how many frames have t <= 2.5 s, the first one being at t = 0."""
    return int(PREFIX_SECONDS * framerate) + 1


def split_clip(frames: Frames, framerate: int) -> tuple[Frames, Frames]:
    """Cut a clip into the prefix that is shown and the continuation that is hidden.

    Parameters
    ----------
    frames
        uint8 (T, H, W, 3), RGB.
    framerate
        Its frames per second [1/s].

    Returns
    -------
    tuple of ndarray
        The frames with t <= 2.5 s, and the others.

    Raises
    ------
    ValueError
        If nothing is left to predict.
    """
    length = prefix_length(framerate)
    if len(frames) <= length:
        raise ValueError(
            f"clip has {len(frames)} frames at {framerate} per second, must have more "
            f"than {length}: the prefix is the first {PREFIX_SECONDS} s"
        )
    return frames[:length], frames[length:]
