"""The frames of a video one at a time, in little memory.

A check that hashes and compares every frame needs no array of all of them: 236 MB for a
sample, and most of what it takes to decode one is to fill that.
"""

import io
import itertools
from collections.abc import Iterator
from typing import Final

import av
import cv2
import numpy as np
from av.error import FFmpegError
from av.video.reformatter import VideoReformatter

from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.run.encode import has_our_planes, iter_mp4, undecodable
from mpmworlds.sim.run.pick import values_of

_PLANAR: Final = "gbrp"  # packed "rgb24" takes half as long again, merging included
_THREADS: Final = 2  # one decodes while the other converts


def frames_of(data: bytes) -> Iterator[Frames]:
    """Yield the frames of a video, uint8 (H, W, 3), RGB, with the bits of `decode_mp4`.

    Each is overwritten by the next.

    Raises
    ------
    ValueError
        If the bytes hold no decodable video, or less than they say.
    """
    seen = 0
    for frame in _of_our_planes(data):
        seen += 1
        yield frame
    if seen < _told(data):  # the others have planes of another kind
        yield from itertools.islice(iter_mp4(data), seen, None)


def _told(data: bytes) -> int:
    with av.open(io.BytesIO(data), "r") as container:
        return container.streams.video[0].frames


def _of_our_planes(data: bytes) -> Iterator[Frames]:
    """The frames up to the first that `encode_mp4` would not have written."""
    try:
        with av.open(io.BytesIO(data), "r") as container:
            stream = container.streams.video[0]
            stream.codec_context.thread_type = "AUTO"
            stream.codec_context.thread_count = _THREADS
            reformatter = VideoReformatter()
            frame = np.empty((stream.height, stream.width, 3), np.uint8)
            for picture in container.decode(stream):
                if not has_our_planes(picture):
                    return
                if (picture.height, picture.width) != frame.shape[:2]:
                    raise undecodable(data)
                planar = reformatter.reformat(picture, format=_PLANAR)
                green, blue, red = map(values_of, planar.planes)
                cv2.merge([red, green, blue], dst=frame)
                yield frame
    except (FFmpegError, IndexError, EOFError):
        raise undecodable(data) from None
