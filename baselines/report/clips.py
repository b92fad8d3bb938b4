"""Clips that a browser plays: references, predictions, and what differs."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.baselines.report.board import Board
from mpmworlds.baselines.report.folder import Folder
from mpmworlds.baselines.results import CLIPS
from mpmworlds.baselines.system import ComparisonError, System
from mpmworlds.loaders.load import Examples
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.run.preview import encode_preview


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
    shown = tqdm(board.samples, desc=f"clips of {board.name}", unit="sample")
    for number, sample in enumerate(shown, 1):
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
    folder.write(path, encode_preview(frames, framerate))
    return path


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
