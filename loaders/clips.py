"""Clips of rows as they are evaluated: reduced while they are decoded.

A row may hold its video already reduced, as `clip`: the same pixels for a quarter of
the time.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from mpmworlds.metrics.reduction import (
    Frames,
    check_framerate,
    is_kept,
    prefix_length,
    reduce_clip,
    reduced_framerate,
    reduced_side,
)
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.run.pick import decode_picked

CLIP: Final = "clip"
VIDEO: Final = "video"


class Clip(NamedTuple):
    """Frames at equal distances in time."""

    frames: Frames
    """uint8 (T, N, N, 3), RGB."""
    framerate: int
    """Frames per second. [1/s]"""


class Stills(NamedTuple):
    """Some frames of a clip."""

    frames: Frames
    """uint8 (n, N, N, 3), RGB."""
    seconds: tuple[float, ...]
    """When each is seen. [s]"""


def clip_of(row: Mapping[str, Any], *, prefix_only: bool = False) -> Clip:
    """Decode the clip of a row of a release.

    Parameters
    ----------
    row
        With the columns `framerate`, and `clip` or `video`.
    prefix_only
        Only the frames with t <= 2.5 s, which takes a quarter of the time.

    Raises
    ------
    ValueError
        If the row has no video, or none that can be decoded; names the row.
    """
    name = next((name for name in (CLIP, VIDEO) if row.get(name) is not None), None)
    if name is None:
        raise ValueError(
            f"{row['id']}: has no video; load another configuration than 'recipes'"
        )
    framerate = reduced_framerate(row["framerate"])
    stored = framerate if name == CLIP else row["framerate"]
    try:
        frames = decode_reduced(row[name]["bytes"], stored, prefix_only)
    except ValueError as error:
        raise ValueError(f"{row['id']}: {error}") from None
    return Clip(frames, framerate)


def sampled(clip: Clip, n: int) -> Stills:
    """Pick n frames of a clip, evenly spread, the first and the last among them.

    Parameters
    ----------
    clip
        Frames, the first one at t = 0.
    n
        How many; all of a clip that has fewer.

    Raises
    ------
    ValueError
        If n < 2.
    """
    if n < 2:
        raise ValueError(f"n = {n} frames, must be at least 2: the first and the last")
    last = len(clip.frames) - 1
    gaps = min(n - 1, last)
    # Rounded to the nearest frame in whole numbers: the same on every machine.
    picked = (2 * np.arange(gaps + 1) * last + gaps) // (2 * gaps or 1)
    seconds = tuple(int(index) / clip.framerate for index in picked)
    return Stills(clip.frames[picked], seconds)


def decode_reduced(data: bytes, framerate: int, prefix_only: bool = False) -> Frames:
    """Decode a video to at most 256 x 256 pixels and 15 frames per second.

    The same bits as `reduce_clip(decode_mp4(data), framerate)`, in less than half of
    the time that the decoding of all alone takes.

    Parameters
    ----------
    data
        The file.
    framerate
        Its frames per second [1/s].
    prefix_only
        Only the frames with t <= 2.5 s.

    Returns
    -------
    ndarray
        uint8 (T, N, N, 3), RGB, at `reduced_framerate(framerate)`.

    Raises
    ------
    ValueError
        If the bytes hold no such video.
    """
    check_framerate(framerate)
    reduced = reduced_framerate(framerate)
    length = prefix_length(reduced) if prefix_only else None
    stop = None if length is None else (length - 1) * framerate // reduced + 1
    kept = partial(is_kept, framerate=framerate)
    frames = decode_picked(data, kept, reduced_side, stop)
    if frames is None:
        frames = reduce_clip(decode_mp4(data), framerate)
    return frames[:length]
