"""Frames to MP4 bytes and back without the loss of a single bit.

H.264 at quantiser 0 stores YUV 4:4:4 losslessly; RGB -> YUV -> RGB is exact for the
colours of `sim.scene.palette`. So the decoded video *is* the simulation's frames, and
it still plays in browsers and decodes with OpenCV alone.
"""

import hashlib
import io
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, Final

import av
import cv2
import numpy as np
import numpy.typing as npt
from av.video.reformatter import ColorRange, Colorspace, VideoReformatter

from mpmworlds.files.scratch import Scratch
from mpmworlds.sim.scene.palette import BACKGROUND, name_of, nearest

Frames = npt.NDArray[np.uint8]

# Names the settings below in every content-addressed key: change both together.
CODEC: Final = "h264-yuv444p-qp0-bt601-placebo-ref2-g60/1"

# The bytes of x264 depend on its thread count. "placebo" with two reference frames is
# 40 % smaller than "medium" on rendered scenes at about the same speed
# (benchmarks/codec.py). A key frame every 60 makes random access cheap for 5 %.
X264: Final = {
    "preset": "placebo",
    "refs": "2",
    "qp": "0",
    "g": "60",
    "threads": "1",
}
_SMPTE170M: Final = 6
_BT601: Final = (5, _SMPTE170M)  # one matrix by two names
_LIMITED_RANGE: Final = 1
_PIXEL_FORMAT: Final = "yuv444p"


class ColorError(ValueError):
    """Frames hold a colour that the codec does not give back unchanged."""


def encode_mp4(frames: Frames, framerate: int) -> bytes:
    """Encode flat-colour frames as lossless H.264 and prove it by decoding them.

    Parameters
    ----------
    frames
        uint8 (T, H, W, 3), RGB.
    framerate
        Frames per second [1/s].

    Returns
    -------
    bytes
        An MP4 file, the same bytes for the same frames.

    Raises
    ------
    ColorError
        If a colour does not survive; names the frame, the colour and its nearest
        palette colour.
    ValueError
        If the array has another type or shape, or the frame rate is not positive.
    """
    check_frames(frames)
    if framerate < 1:
        raise ValueError(f"framerate = {framerate}, must be at least 1 frame a second")
    _check_colors(frames)
    sent: list[bytes] = []
    data = encode_unchecked(frames, framerate, sent)
    if list(_received(data)) != sent:
        raise ColorError("the codec has changed a picture; report it with the frames")
    return data


def encode_unchecked(
    frames: Frames, framerate: int, digests: list[bytes] | None = None
) -> bytes:
    """Encode like ``encode_mp4``, without the proof that every colour survives.

    Parameters
    ----------
    frames
        uint8 (T, H, W, 3), RGB.
    framerate
        Frames per second [1/s].
    digests
        Takes one of the YUV planes of each picture, if it is given.

    Returns
    -------
    bytes
        An MP4 file; colours outside the palette may come back changed by up to 2.
    """
    # The index can be moved to the front only in a file that is read back.
    with Scratch() as scratch:
        path = scratch.path / "clip.mp4"
        options = {"movflags": "+faststart", "fflags": "+bitexact"}
        with av.open(str(path), "w", format="mp4", options=options) as container:
            stream = container.add_stream("libx264", rate=framerate, options=X264)
            _, stream.height, stream.width, _ = frames.shape
            stream.pix_fmt = _PIXEL_FORMAT
            codec = stream.codec_context
            codec.thread_count = 1
            codec.colorspace = codec.color_primaries = codec.color_trc = _SMPTE170M
            codec.color_range = _LIMITED_RANGE
            for picture in _pictures(frames):
                if digests is not None:
                    digests.append(_digest(picture))
                container.mux(stream.encode(picture))
            container.mux(stream.encode(None))
        return path.read_bytes()


def decode_mp4(data: bytes) -> Frames:
    """Decode an MP4 file held in memory.

    Parameters
    ----------
    data
        A file as ``encode_mp4`` returns it (any video that OpenCV decodes will do).

    Returns
    -------
    ndarray
        uint8 (T, H, W, 3), RGB.

    Raises
    ------
    ValueError
        If the bytes hold no decodable video.
    """
    frames = list(iter_mp4(data))
    return np.stack(frames)


def iter_mp4(data: bytes) -> Iterator[Frames]:
    """Yield the frames of an MP4 file one at a time, uint8 (H, W, 3), RGB.

    Raises
    ------
    ValueError
        If the bytes hold no decodable video.
    """
    # No explicit release(): it drops the last reference to the source without holding
    # the interpreter lock, and OpenCV 5 crashes. Leaving the function is enough.
    source: Any = io.BytesIO(data)  # OpenCV's type stub asks for its own reader class
    video = cv2.VideoCapture(source, cv2.CAP_FFMPEG, [])
    found, frame = video.read()
    if not found:
        raise undecodable(data)
    while found:
        yield cv2.cvtColor(frame, cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)
        found, frame = video.read()


def undecodable(data: bytes) -> ValueError:
    """Say that bytes are no video, or not all of one."""
    return ValueError(
        f"{len(data)} bytes hold no decodable video: the data is truncated or "
        "corrupt; fetch or render it again"
    )


def has_our_planes(picture: av.VideoFrame) -> bool:
    """Whether the planes of a decoded picture are what `encode_mp4` writes."""
    return (
        picture.format.name == _PIXEL_FORMAT
        and picture.colorspace in _BT601
        and picture.color_range == _LIMITED_RANGE
    )


def frames_sha256(frames: Frames) -> str:
    """Return the SHA-256 of the shape and the RGB values of a clip, in hexadecimal.

    Parameters
    ----------
    frames
        uint8 (T, H, W, 3), RGB.

    Raises
    ------
    ValueError
        If the array has another type or shape.
    """
    check_frames(frames)
    digest = hashlib.sha256(f"uint8 {frames.shape}\n".encode())
    digest.update(np.ascontiguousarray(frames).data)
    return digest.hexdigest()


def check_frames(frames: Frames) -> None:
    """Raise `ValueError` unless frames are uint8 (T, H, W, 3) and there are some."""
    if frames.dtype != np.uint8 or frames.ndim != 4 or frames.shape[-1] != 3:
        raise ValueError(
            f"frames are {frames.dtype} {frames.shape}, must be uint8 (T, H, W, 3)"
        )
    if 0 in frames.shape:
        raise ValueError(f"frames have shape {frames.shape}, no axis may be empty")


def _pictures(frames: Frames) -> Iterator[av.VideoFrame]:
    to_yuv = VideoReformatter()
    for frame in frames:
        yield to_yuv.reformat(
            av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), format="rgb24"),
            format=_PIXEL_FORMAT,
            src_color_range=ColorRange.JPEG,
            dst_colorspace=Colorspace.ITU601,
            dst_color_range=ColorRange.MPEG,
        )


def _digest(picture: av.VideoFrame) -> bytes:
    """SHA-256 of the planes of a picture."""
    digest = hashlib.sha256()
    for plane in picture.planes:
        rows = np.frombuffer(memoryview(plane), np.uint8).reshape(
            plane.height, plane.line_size
        )
        digest.update(np.ascontiguousarray(rows[:, : plane.width]).data)
    return digest.digest()


def _received(data: bytes) -> Iterator[bytes]:
    """Digests of the pictures of a file."""
    with av.open(io.BytesIO(data), "r") as container:
        container.streams.video[0].codec_context.thread_count = 1
        for picture in container.decode(video=0):
            yield _digest(picture)


def _check_colors(frames: Frames) -> None:
    """Hold frames to colours that come back from the planes of a video unchanged.

    Each pixel is converted by itself, as no plane is smaller than the picture, so it is
    enough to look at each colour once.
    """
    seen = np.zeros(1 << 24, np.bool_)
    for frame in frames:
        seen[_packed(frame)] = True
    lost = _lost(tuple(np.flatnonzero(seen).tolist()))
    if not lost:
        return
    for index, frame in enumerate(frames):
        places = np.argwhere(np.isin(_packed(frame), lost))
        if len(places):
            row, column = (int(i) for i in places[0])
            color = "#{:02X}{:02X}{:02X}".format(*frame[row, column])
            raise ColorError(
                f"frame {index}: colour {color} at row {row}, column {column} does not "
                f"survive the codec; draw with palette colours on {BACKGROUND}, the "
                f"nearest is {nearest(color)} ({name_of(color)})"
            )


def _packed(frame: Frames) -> npt.NDArray[np.uint32]:
    """Colours of a frame (H, W) as numbers."""
    bgra = cv2.cvtColor(np.ascontiguousarray(frame), cv2.COLOR_RGB2BGRA)
    numbers: Any = bgra.view("<u4")[..., 0] & 0xFFFFFF
    return np.asarray(numbers, np.uint32)


@lru_cache(256)
def _lost(colors: tuple[int, ...]) -> tuple[int, ...]:
    """Those of some colours that a video gives back changed."""
    squares = np.resize(np.array(colors, "<u4"), (-(-len(colors) // 16), 4, 4))
    wide = np.ascontiguousarray(squares.repeat(16, axis=1).repeat(16, axis=2))
    rgb = wide.view(np.uint8).reshape(*wide.shape, 4)[..., 2::-1]
    received = decode_mp4(encode_unchecked(np.ascontiguousarray(rgb), 1))
    changed = np.unique(wide[(rgb != received).any(axis=-1)])
    return tuple(int(color) for color in changed)
