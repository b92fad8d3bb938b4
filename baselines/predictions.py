"""Predictions that were made elsewhere: videos, programs or scenes in a folder."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, TypeAlias

import cv2
import numpy as np

from mpmworlds.baselines.protocol import (
    Answer,
    Candidate,
    Failure,
    ProgramText,
    SceneText,
    Task,
)
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.splits.ids import SampleId

VIDEOS: Final = (".mp4", ".npy")
Text: TypeAlias = type[ProgramText] | type[SceneText]
TEXTS: Final[Mapping[str, Text]] = {".py": ProgramText, ".yaml": SceneText}
KINDS: Final = (*VIDEOS, *TEXTS)


class PredictionsError(ValueError):
    """A folder that holds no predictions, or a file in it that is none."""


def prediction_files(folder: Path) -> dict[str, list[Path]]:
    """Files of predictions by sample.

    Parameters
    ----------
    folder
        With ``ID.EXT``, or ``ID/0.EXT``, ``ID/1.EXT``, ... of several candidates; the
        extension is .mp4 or .npy of frames, .py of a program, .yaml of a scene.

    Returns
    -------
    dict
        Id -> files in the order of the candidates, by id.

    Raises
    ------
    PredictionsError
        If there are none, a name is no id of a sample, candidates are not numbered
        from 0 on, or a sample has predictions at both places.
    """
    if not folder.is_dir():
        raise PredictionsError(f"{folder}: there is no such folder")
    found: dict[str, list[Path]] = {}
    for path in sorted(folder.iterdir()):
        name = path.name if path.is_dir() else path.stem
        if path.is_file() and path.suffix not in KINDS:
            continue
        try:
            SampleId.parse(name)
        except ValueError as error:
            raise PredictionsError(f"{path}: {error}; name it by a sample") from None
        files = list(_candidates(path)) if path.is_dir() else [path]
        if name in found:
            raise PredictionsError(f"{path}: {name} has another prediction beside it")
        found[name] = files
    if not found:
        raise PredictionsError(
            f"{folder}: no predictions; name them ID.EXT, or ID/0.EXT and so on for "
            f"several candidates, with EXT one of {', '.join(KINDS)}"
        )
    return found


def _candidates(folder: Path) -> Iterator[Path]:
    files = {p.stem: p for p in sorted(folder.iterdir()) if p.suffix in KINDS}
    numbers = [str(k) for k in range(len(files))]
    if not files or set(files) != set(numbers):
        raise PredictionsError(
            f"{folder}: candidates {sorted(files)}, must be numbered 0, 1, 2, ..., one "
            "file each"
        )
    return (files[number] for number in numbers)


class Predictions:
    """Answers with what lies in a folder, see `prediction_files`.

    Parameters
    ----------
    folder
        The folder.
    name
        What to call the system in results.
    """

    def __init__(self, folder: str, name: str = "") -> None:
        self._files = prediction_files(Path(folder))
        self.name = name or Path(folder).resolve().name
        digest = hashlib.sha256()
        for sample, files in self._files.items():
            for path in files:
                content = hashlib.sha256(path.read_bytes()).hexdigest()
                digest.update(f"{sample}/{path.suffix} {content}\n".encode())
        self.configuration = {"folder": "", "predictions_sha256": digest.hexdigest()}

    def look_up(self, sample_id: str, task: Task) -> Sequence[Answer]:
        """Return the predictions of a sample."""
        files = self._files.get(sample_id, [])
        if not files:
            return [Failure("missing", "there is no prediction of this sample")]
        return [read_prediction(path, task) for path in files]


def read_prediction(path: Path, task: Task) -> Answer:
    """One prediction, or what is wrong with it."""
    if path.suffix in TEXTS:
        try:
            return TEXTS[path.suffix](path.read_text("utf-8"))
        except UnicodeDecodeError as error:
            return Failure("wrong_type", f"{path.name}: is no UTF-8 text ({error})")
    try:
        frames = _array(path) if path.suffix == ".npy" else _video(path, task)
    except ValueError as error:
        return Failure("wrong_type", f"{path.name}: {error}")
    seen = len(task.prefix)
    if frames.ndim == 4 and len(frames) == seen + task.horizon:
        return Candidate(frames[seen:], frames[:seen])
    return Candidate(frames)


def _array(path: Path) -> Frames:
    """Frames of any dtype: what they are is checked where they are scored."""
    frames: Frames = np.load(path, allow_pickle=False)
    return frames


def _video(path: Path, task: Task) -> Frames:
    reader = cv2.VideoCapture(str(path))
    rate = reader.get(cv2.CAP_PROP_FPS)
    reader.release()
    if rate and abs(rate - task.framerate) > 0.01:
        raise ValueError(
            f"has {rate:g} frames per second, must have {task.framerate}; reduce it as "
            "references are: mpmworlds.metrics.reduction.reduce_clip"
        )
    return decode_mp4(path.read_bytes())
