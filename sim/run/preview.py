"""Previews for eyes: a video that plays everywhere, and one picture of it.

The exact video is H.264 4:4:4, which Safari, QuickTime and Windows do not play. What
is made here is 4:2:0 and lossy, and for nothing but looking at.
"""

from collections.abc import Iterator
from typing import Final

import av
import cv2
import numpy as np
from av.video.reformatter import ColorRange, Colorspace, VideoReformatter

from mpmworlds.files.scratch import Scratch
from mpmworlds.sim.run.encode import Frames, check_frames

# Names the settings below where previews are kept: change both together.
PREVIEW_CODEC: Final = "h264-yuv420p-crf23-bt601-medium-g1s/2"

_BT601: Final = 6  # its number among the colour spaces of a stream
# The bytes of x264 depend on its thread count, and its macroblock tree reads memory it
# never wrote where the width of a picture is no multiple of 128 pixels.
_X264: Final = {
    "preset": "medium",
    "crf": "23",
    "threads": "1",
    "x264-params": "mbtree=0",
}
_STRIDE: Final = 4  # pixels: enough to choose a frame by, at a tenth of the time


def encode_preview(frames: Frames, framerate: int) -> bytes:
    """Encode a clip as H.264 4:2:0, which every browser plays.

    Sides that are odd are extended by a pixel, as 4:2:0 has colours of pairs.

    Parameters
    ----------
    frames
        uint8 (T, H, W, 3), RGB: a clip as it is evaluated, 256 pixels wide.
    framerate
        Its frames per second [1/s], 15 as it is evaluated.

    Returns
    -------
    bytes
        An MP4 file, the same bytes for the same frames.

    Raises
    ------
    ValueError
        If the array has another type or shape, or the frame rate is not positive.
    """
    check_frames(frames)
    if framerate < 1:
        raise ValueError(f"framerate = {framerate}, must be at least 1 frame a second")
    odd = [(0, 0), *((0, side % 2) for side in frames.shape[1:3]), (0, 0)]
    frames = np.pad(frames, odd, mode="edge")
    # The index can be moved to the front only in a file that is read back.
    with Scratch() as scratch:
        path = scratch.path / "clip.mp4"
        options = {"movflags": "+faststart", "fflags": "+bitexact"}
        with av.open(str(path), "w", format="mp4", options=options) as container:
            scrubbing = {"g": str(framerate)}  # a key frame each second keeps it smooth
            stream = container.add_stream(
                "libx264", rate=framerate, options=_X264 | scrubbing
            )
            _, stream.height, stream.width, _ = frames.shape
            stream.pix_fmt = "yuv420p"
            codec = stream.codec_context
            codec.thread_count = 1
            codec.colorspace = codec.color_primaries = codec.color_trc = _BT601
            codec.color_range = ColorRange.MPEG
            for picture in _pictures(frames):
                container.mux(stream.encode(picture))
            container.mux(stream.encode(None))
        return path.read_bytes()


def poster(frames: Frames) -> bytes:
    """Draw the frame that differs most from both the first and the last one.

    A scene may begin empty and end at rest; what happens lies between.

    Parameters
    ----------
    frames
        uint8 (T, H, W, 3), RGB.

    Returns
    -------
    bytes
        A PNG file, the same bytes for the same frames.

    Raises
    ------
    ValueError
        If the array has another type or shape.
    """
    check_frames(frames)
    coarse = frames[:, ::_STRIDE, ::_STRIDE]
    apart = [
        min(_pixels_apart(frame, coarse[0]), _pixels_apart(frame, coarse[-1]))
        for frame in coarse
    ]
    shown = cv2.cvtColor(frames[int(np.argmax(apart))], cv2.COLOR_RGB2BGR)
    return bytes(cv2.imencode(".png", shown, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1])


def _pixels_apart(one: Frames, other: Frames) -> int:
    """Number of pixels in which two pictures differ."""
    return int((one != other).any(axis=-1).sum())


def _pictures(frames: Frames) -> Iterator[av.VideoFrame]:
    to_yuv = VideoReformatter()
    for frame in frames:
        yield to_yuv.reformat(
            av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), format="rgb24"),
            format="yuv420p",
            src_color_range=ColorRange.JPEG,
            dst_colorspace=Colorspace.ITU601,
            dst_color_range=ColorRange.MPEG,
        )
