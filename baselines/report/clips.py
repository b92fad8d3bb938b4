"""Clips that a browser plays: references, predictions, and what differs."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace, VideoReformatter

from mpmworlds.baselines.report.board import Board
from mpmworlds.baselines.report.folder import Folder
from mpmworlds.baselines.results import CLIPS
from mpmworlds.baselines.system import ComparisonError, System
from mpmworlds.files.scratch import Scratch
from mpmworlds.loaders.load import Examples
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.run.encode import decode_mp4

BT601: Final = 6  # its number among the colour spaces of a stream
# Browsers' decoders in hardware, Safari and Windows play 4:2:0 only. The bytes of x264
# depend on its thread count.
X264: Final = {"preset": "medium", "crf": "18", "threads": "1"}


@dataclass(frozen=True)
class SampleClips:
    """Clips of one sample: paths from the page."""

    reference: str = ""
    """Its continuation; empty without a release."""
    predictions: dict[str, str] = field(default_factory=dict)
    """Label -> what the system predicted."""
    differences: dict[str, str] = field(default_factory=dict)
    """Label -> the absolute difference of the two."""


def write_clips(
    board: Board, folder: Folder, examples: Examples | None
) -> dict[str, SampleClips]:
    """Write the clips of a board, those of the samples that any system has clips of.

    Parameters
    ----------
    board
        Whose samples.
    folder
        Where to.
    examples
        The split as a release has it; without it there are no references.

    Returns
    -------
    dict
        Sample -> its clips.

    Raises
    ------
    ComparisonError
        If a clip cannot be read, or is of another size or length than its reference.
    """
    names = [] if examples is None else examples.table["id"]
    places = {name: place for place, name in enumerate(names)}
    written = {}
    for number, sample in enumerate(board.samples, 1):
        paths = dict(_clips_of(board, sample))
        if not paths and examples is None:
            continue
        reference = None if examples is None else examples[places[sample]].continuation
        start = f"{CLIPS}/{board.config}-{board.split}/{number:04d}"
        write = partial(_write, folder, start, board.framerate)
        written[sample] = _write_sample(board, paths, reference, write)
    return written


def _write_sample(
    board: Board,
    paths: Mapping[str, Path],
    reference: Frames | None,
    write: Callable[[str, Frames], str],
) -> SampleClips:
    clips = SampleClips(write("reference", reference) if reference is not None else "")
    for place, system in enumerate(board.systems, 1):
        if system.label not in paths:
            continue
        name, path = f"{place:02d}", paths[system.label]
        frames = _read(path)
        clips.predictions[system.label] = write(name, frames)
        if reference is not None:
            apart = _difference(frames, reference, path)
            clips.differences[system.label] = write(f"{name}-difference", apart)
    return clips


def _write(
    folder: Folder, start: str, framerate: int, name: str, frames: Frames
) -> str:
    path = f"{start}/{name}.mp4"
    folder.write(path, preview_mp4(frames, framerate))
    return path


def preview_mp4(frames: Frames, framerate: int) -> bytes:
    """Encode frames as H.264 4:2:0, which every browser plays; always the same bytes.

    Sides that are odd are extended by a pixel.
    """
    odd = [(0, 0), *((0, side % 2) for side in frames.shape[1:3]), (0, 0)]
    frames = np.pad(frames, odd, mode="edge")
    # The index can be moved to the front only in a file that is read back.
    with Scratch() as scratch:
        path = scratch.path / "clip.mp4"
        options = {"movflags": "+faststart", "fflags": "+bitexact"}
        with av.open(str(path), "w", format="mp4", options=options) as container:
            scrubbing = {"g": str(framerate)}  # a key frame each second keeps it smooth
            stream = container.add_stream(
                "libx264", rate=framerate, options=X264 | scrubbing
            )
            _, stream.height, stream.width, _ = frames.shape
            stream.pix_fmt = "yuv420p"
            codec = stream.codec_context
            codec.thread_count = 1
            codec.colorspace = codec.color_primaries = codec.color_trc = BT601
            codec.color_range = ColorRange.MPEG
            for picture in _pictures(frames):
                container.mux(stream.encode(picture))
            container.mux(stream.encode(None))
        return path.read_bytes()


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


def _clips_of(board: Board, sample: str) -> Iterator[tuple[str, Path]]:
    for system in board.systems:
        path = _path(system, sample)
        if path.is_file():
            yield system.label, path


def _path(system: System, sample: str) -> Path:
    return system.folder / CLIPS / f"{sample}.mp4"


def _read(path: Path) -> Frames:
    try:
        return decode_mp4(path.read_bytes())
    except ValueError as error:
        raise ComparisonError(f"{path}: {error}") from error


def _difference(frames: Frames, reference: Frames, path: Path) -> Frames:
    if frames.shape != reference.shape:
        raise ComparisonError(
            f"{path}: is of shape {frames.shape}, must be {reference.shape}, that of "
            "the continuation; save clips as they were evaluated"
        )
    return np.maximum(frames, reference) - np.minimum(frames, reference)
