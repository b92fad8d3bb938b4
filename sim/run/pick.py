"""Some pixels of some frames of a video, without the cost of all the others.

Every frame has to be decoded, since each is told by the one before it. But most of what
a decoder of pictures takes goes into colours: OpenCV turns every plane into RGB. Here
only the pixels that are kept are converted, by the library that OpenCV uses as well, so
that each of the 2^24 values of a pixel becomes the same colour.
"""

import io
from collections.abc import Callable
from typing import Final

import av
import cv2
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.video.plane import VideoPlane
from av.video.reformatter import Interpolation, VideoReformatter

from mpmworlds.sim.run.encode import Frames, has_our_planes, undecodable

_PLANAR: Final = "gbrp"  # takes two thirds of the time of packed "rgb24"
_THREADS: Final = 2  # one decodes while the other converts


def decode_picked(
    data: bytes,
    is_kept: Callable[[int], bool],
    side_of: Callable[[int, int], int],
    stop: int | None = None,
) -> Frames | None:
    """Decode some frames of a video of `encode_mp4`, made smaller by picking pixels.

    Pixel i of the result is the pixel under its centre, floor((i + 1/2) N / side).

    Parameters
    ----------
    data
        The file.
    is_kept
        Whether a frame is kept, by its number from 0.
    side_of
        Pixels per side that are kept of a picture of a height and width [pixels].
    stop
        Number of the first frame that is not looked at any more; None for no such.

    Returns
    -------
    ndarray or None
        uint8 (T, side, side, 3), RGB; None if the file is a video of another kind.

    Raises
    ------
    ValueError
        If the bytes hold no decodable video, or less than they say, or `side_of`
        refuses the picture.
    """
    try:
        with av.open(io.BytesIO(data), "r") as container:
            return _decode(container, is_kept, side_of, stop)
    except (FFmpegError, IndexError, EOFError):
        raise undecodable(data) from None


def _decode(
    container: InputContainer,
    is_kept: Callable[[int], bool],
    side_of: Callable[[int, int], int],
    stop: int | None,
) -> Frames | None:
    stream = container.streams.video[0]
    stream.codec_context.thread_type = "AUTO"
    stream.codec_context.thread_count = _THREADS
    end = stream.frames if stop is None else min(stream.frames, stop)
    kept = [index for index in range(end) if is_kept(index)]
    places = {index: place for place, index in enumerate(kept)}
    reformatter = VideoReformatter()
    frames = None
    seen = 0
    for picture in container.decode(stream):
        if seen == stop:
            break
        if seen == stream.frames or not has_our_planes(picture):
            return None
        if frames is None:
            side = side_of(picture.height, picture.width)
            frames = np.empty((len(kept), side, side, 3), np.uint8)
        if seen in places:
            smaller = reformatter.reformat(
                picture, side, side, _PLANAR, interpolation=Interpolation.POINT
            )
            green, blue, red = map(values_of, smaller.planes)
            cv2.merge([red, green, blue], dst=frames[places[seen]])
        seen += 1
    if seen < end:
        raise EOFError
    return frames


def values_of(plane: VideoPlane) -> Frames:
    """Values (height, width) of a plane, as a view."""
    rows = np.asarray(memoryview(plane), np.uint8)  # of a line each, padded
    return rows.reshape(plane.height, plane.line_size)[:, : plane.width]
