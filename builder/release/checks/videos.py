"""The videos of a row: decoded, counted, timed, and compared with each other."""

import hashlib
import io
import itertools
from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final, NamedTuple

import av
import cv2
import numpy as np
import numpy.typing as npt
from av.error import FFmpegError

from mpmworlds.builder.release.checks.stream import frames_of
from mpmworlds.builder.release.checks.values import Row
from mpmworlds.metrics.reduction import (
    Frames,
    is_kept,
    reduce_clip,
    reduced_framerate,
    reduced_side,
)
from mpmworlds.sim.run.encode import decode_mp4, undecodable
from mpmworlds.sim.run.pick import decode_picked

# Mean absolute difference of a frame of a preview and that of its clip, of 255, both
# averaged over blocks: single pixels lose their colour, up to 17 where drops of two
# colours mix. By blocks the worst frame of `mini` has 3.6, and frames of another sample
# have 9 or more.
MOST_APART: Final = 8.0
BLOCK: Final = 4  # pixels along a side

_LARGEST: Final = 512  # pixels along a side of a preview
_MOST_FRAMES: Final = 10_000
_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"


class Facts(NamedTuple):
    """What a video says of itself, before it is decoded."""

    frames: int
    height: int
    width: int
    framerate: Fraction | None
    """Frames per second, if all are seen equally long. [1/s]"""


def facts_of(data: bytes) -> Facts:
    """Read how many frames a video has, how large they are and when they are seen.

    Raises
    ------
    ValueError
        If the bytes hold no video.
    """
    try:
        with av.open(io.BytesIO(data), "r") as container:
            stream = container.streams.video[0]
            times = [
                packet.pts * packet.time_base
                for packet in container.demux(stream)
                if packet.pts is not None and packet.time_base is not None
            ]
            height, width, said = stream.height, stream.width, stream.frames
    except (FFmpegError, IndexError, EOFError, OverflowError):
        raise undecodable(data) from None
    if said != len(times):
        raise ValueError(f"says it has {said} frames, has {len(times)}")
    times.sort()
    steps = {after - before for before, after in itertools.pairwise(times)}
    step = steps.pop() if len(steps) == 1 else None
    steady = step is not None and step > 0 and times[0] == 0
    rate = 1 / step if step is not None and steady else None
    return Facts(len(times), height, width, rate)


def decoded(data: bytes, frames: int, side: int, framerate: int) -> Frames:
    """Decode a video that must have so many frames, of such a size and rate.

    Raises
    ------
    ValueError
        Saying what is wrong with it. What it says of itself is looked at first, so that
        none is decoded that says it has millions of pictures.
    """
    found = facts_of(data)
    _check_facts(found, frames, side, framerate)
    pictures = decode_picked(data, lambda _: True, reduced_side_of_all)
    if pictures is None:
        pictures = decode_mp4(data)
    if pictures.shape != (frames, side, side, 3):
        raise ValueError(f"decodes to {pictures.shape}, says it is {found[:3]}")
    return pictures


def _check_facts(found: Facts, frames: int, side: int, framerate: int) -> None:
    """Raise `ValueError` unless a video says that it is what it must be."""
    if (found.frames, found.height, found.width) != (frames, side, side):
        raise ValueError(
            f"is {found[:3]} (frames, height, width), must be {(frames, side, side)}"
        )
    if frames > 1 and found.framerate != framerate:
        shown = "no steady rate" if found.framerate is None else f"{found.framerate}"
        raise ValueError(f"has {shown} frames per second, must have {framerate}")


def reduced_side_of_all(height: int, width: int) -> int:
    """Keep all pixels; raises `ValueError` if the picture is not square."""
    reduced_side(height, width)
    return height


def video_faults(row: Row) -> Iterator[str]:
    """Say what is wrong with the video and the clip of a rendered row."""
    clip = None
    try:
        clip = decoded_clip(row)
    except (ValueError, cv2.error) as error:
        yield f"its clip: {error}"
    if "video" not in row:
        return
    try:
        digest, is_alike = _compared(row, clip)
    except (ValueError, cv2.error) as error:
        yield f"its video: {error}"
        return
    if digest != row["frames_sha256"]:
        yield "its video does not hold the frames that frames_sha256 names"
    if not is_alike:
        yield "its clip is not its video reduced"


def _compared(row: Row, clip: Frames | None) -> tuple[str, bool]:
    """Hash of the frames of a video, and whether they reduce to a clip.

    The hash is that of `frames_sha256`. Without a clip there is nothing to differ.
    """
    count, side, rate = row["num_frames"], row["resolution"], row["framerate"]
    data = row["video"]["bytes"]
    _check_facts(facts_of(data), count, side, rate)
    kept = _kept_pixels(side)
    digest = hashlib.sha256(f"uint8 {(count, side, side, 3)}\n".encode())
    references = iter(()) if clip is None else iter(clip)
    is_alike, seen = True, 0
    for frame in frames_of(data):
        if frame.shape != (side, side, 3) or seen == count:
            raise ValueError(f"decodes to other frames than {count} of {side} px")
        digest.update(frame.data)
        if is_kept(seen, rate):
            reference = next(references, None)
            if reference is not None and is_alike:
                picked = frame.reshape(-1, 3).take(kept, axis=0)
                is_alike = np.array_equal(picked, reference.reshape(-1, 3))
        seen += 1
    if seen != count:
        raise ValueError(f"decodes to {seen} frames, says it has {count}")
    return digest.hexdigest(), is_alike


@lru_cache(8)
def _kept_pixels(side: int) -> npt.NDArray[np.intp]:
    """Which pixels of a picture `reduce_clip` keeps, counted row by row.

    Found by reducing a picture of numbers, as one take by these is four times as fast.
    """
    numbers = np.arange(side * side, dtype="<u4").view(np.uint8)
    parts = numbers.reshape(side, side, 4)
    low, high = (reduce_clip(parts[None, ..., k : k + 3], 1)[0] for k in (0, 1))
    whole = np.concatenate([low, high[..., 2:]], axis=-1)
    return whole.copy().view("<u4").reshape(-1).astype(np.intp)


def decoded_clip(row: Row) -> Frames:
    """Decode the clip of a row; raises `ValueError`, see `decoded`."""
    count, side, rate = row["num_frames"], row["resolution"], row["framerate"]
    reduced = reduced_framerate(rate)
    kept = -(-count * reduced // rate)
    return decoded(row["clip"]["bytes"], kept, reduced_side(side, side), reduced)


def preview_faults(row: Row, clip_row: Row | None) -> Iterator[str]:
    """Say what is wrong with the preview and the poster of a row.

    Parameters
    ----------
    row
        A row of the configuration of previews.
    clip_row
        A rendered row of the same sample, or None if there is none to compare with.
    """
    preview = picture = None
    clip = None if clip_row is None else _clip_to_compare(clip_row)
    try:
        facts = facts_of(row["preview"]["bytes"])
        if clip is not None and clip_row is not None:
            expected = (len(clip), *(side + side % 2 for side in clip.shape[1:3]))
            if facts[:3] != expected:
                raise ValueError(
                    f"is {facts[:3]} (frames, height, width), must be {expected}"
                )
            rate = reduced_framerate(clip_row["framerate"])
            if len(clip) > 1 and facts.framerate != rate:
                raise ValueError(
                    f"has {facts.framerate} frames per second, must have {rate}"
                )
        if max(facts[1:3]) > _LARGEST or facts.frames > _MOST_FRAMES:
            raise ValueError(f"is {facts[:3]} (frames, height, width), too large")
        preview = decode_mp4(row["preview"]["bytes"])
    except (ValueError, cv2.error) as error:
        yield f"its preview: {error}"
    try:
        picture = _picture(row["poster"]["bytes"])
    except ValueError as error:
        yield f"its poster: {error}"
    if clip is None:
        return
    if preview is not None:
        _, height, width, _ = clip.shape
        apart = _apart(preview[:, :height, :width], clip)
        if apart > MOST_APART:
            yield (
                f"its preview is up to {apart:.1f} of 255 apart from its clip on "
                f"average, must be at most {MOST_APART:.0f}"
            )
    if picture is not None and not any(
        np.array_equal(picture, frame) for frame in clip
    ):
        yield "its poster is no frame of its clip"


def _clip_to_compare(row: Row) -> Frames | None:
    """The clip of a row, or None if it has a finding of its own."""
    columns = ("clip", "num_frames", "resolution", "framerate")
    values = [row[name] for name in columns]
    if None in values or row["clip"]["bytes"] is None:
        return None
    try:
        return decoded_clip(row)
    except (ValueError, ArithmeticError, cv2.error):
        return None


def _picture(data: bytes) -> Frames:
    sides = data[16:24]
    if not data.startswith(_SIGNATURE) or len(sides) < 8:
        raise ValueError("is no PNG file")
    width, height = int.from_bytes(sides[:4], "big"), int.from_bytes(sides[4:], "big")
    if not 0 < max(width, height) <= _LARGEST:
        raise ValueError(f"is {width} x {height} px, must be at most {_LARGEST}")
    found: Any = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    if found is None:
        raise ValueError("cannot be decoded: it is truncated or corrupt")
    return np.asarray(cv2.cvtColor(found, cv2.COLOR_BGR2RGB), np.uint8)


def _apart(one: Frames, other: Frames) -> float:
    if one.shape != other.shape:
        return 255.0
    pairs = zip(map(_averaged, one), map(_averaged, other), strict=True)
    return max(float(cv2.absdiff(a, b).mean()) for a, b in pairs)


def _averaged(frame: Frames) -> Frames:
    """Means of blocks of a frame."""
    height, width, _ = frame.shape
    size = (max(width // BLOCK, 1), max(height // BLOCK, 1))
    return np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), np.uint8)
