"""A video file of anyone's, as a prefix to be explained."""

import math
from pathlib import Path
from typing import Final, NamedTuple

import av
import numpy as np

from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import (
    SIDE,
    Frames,
    prefix_length,
    reduce_clip,
    reduced_framerate,
)

SECONDS: Final = 10.0  # of a video of the benchmark
DRAWN: Final = 512  # pixels per side of such a video before it was reduced
MOST_SECONDS: Final = 3.0  # that are read of a file: what comes later is not needed


class Clip(NamedTuple):
    """The beginning of a video, as it is evaluated."""

    prefix: Frames
    """uint8 (T, N, N, 3), RGB, at most 2.5 s."""
    framerate: int
    """Frames per second. [1/s]"""
    form: VideoForm
    """Of the whole video that scenes of it draw."""


def read_clip(path: Path) -> Clip:
    """Read the beginning of a video file.

    Raises
    ------
    ValueError
        If it is no video, or not square.
    """
    try:
        with av.open(str(path)) as container:
            stream = container.streams.video[0]
            rate = max(round(float(stream.average_rate or 0)), 1)
            frames = []
            for picture in container.decode(stream):
                frames.append(picture.to_ndarray(format="rgb24"))
                if len(frames) > MOST_SECONDS * rate:
                    break
    except (av.FFmpegError, IndexError) as error:
        if isinstance(error, OSError):
            raise
        raise ValueError(f"{path}: is no video that can be read ({error})") from None
    if not frames:
        raise ValueError(f"{path}: has no frames")
    try:
        reduced = reduce_clip(np.stack(frames), rate)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    own = frames[0].shape[0]
    side = own + own % 2
    form = VideoForm(math.ceil(SECONDS * rate), rate, DRAWN if own == SIDE else side)
    kept = reduced_framerate(rate)
    return Clip(reduced[: prefix_length(kept)], kept, form)
