"""Windows of labels to train on: a pure function of a seed and a number."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from torch.utils.data import Dataset

from mpmworlds.baselines.small.fields import Fields, fields_of
from mpmworlds.baselines.small.slots import SLOTS, LabelFrames, Slots, shuffled
from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.clips import clip_of
from mpmworlds.loaders.export.folder import place_of
from mpmworlds.loaders.load import Examples, neutral_name, side_info_of
from mpmworlds.metrics.reduction import prefix_length

_FIELDS: Final = "fields"


class Window(NamedTuple):
    """Some frames of a sample, and what is told of it."""

    labels: LabelFrames
    """uint8 (frames, N, N)."""
    fields: Fields
    """float32 (CLASSES, FEATURES); zero where nothing is told."""


class LabelFiles:
    """Labels of the clips of a split, decoded once and kept in files.

    A file has each frame by itself, so that a window reads no more than it needs; it is
    written whole or not at all, so several may write at once.

    Parameters
    ----------
    examples
        The samples; their regime says what is told.
    folder
        Where the files are kept; of this release and regime alone.
    """

    def __init__(self, examples: Examples, folder: Path) -> None:
        self.examples = examples
        self._names = list(examples.table["id"])
        self._folder = folder

    def __len__(self) -> int:
        return len(self._names)

    def length(self, index: int) -> int:
        """Number of frames of a sample."""
        with np.load(self._file(index)) as file:
            return len(file.files) - 1

    def window(self, index: int, start: int, count: int) -> Window:
        """Read some frames."""
        with np.load(self._file(index)) as file:
            frames = [file[f"{number:04d}"] for number in range(start, start + count)]
            return Window(np.stack(frames), file[_FIELDS])

    def _file(self, index: int) -> Path:
        path = self._folder / place_of(neutral_name(self._names[index]), ".npz")
        if not path.is_file():
            row = self.examples.table[index]
            clip = clip_of(row)
            slots = Slots.of(clip.frames[: prefix_length(clip.framerate)])
            labels = slots.labels(clip.frames)
            told = fields_of(side_info_of(row, self.examples.regime), slots)
            members = {f"{number:04d}": frame for number, frame in enumerate(labels)}
            buffer = io.BytesIO()
            np.savez_compressed(buffer, **{_FIELDS: told}, **members)  # type: ignore[arg-type]
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, buffer.getvalue())
        return path


class Windows(Dataset[Window]):
    """As many windows as are asked for, drawn by number.

    Parameters
    ----------
    files
        The samples.
    chosen
        Indices of those that are drawn.
    weights
        How often each of them is drawn, up to a factor.
    frames
        Of a window.
    seed
        Of all draws.
    flips
        Whether a window may be mirrored: not where something is told of left and right.
    """

    def __init__(
        self,
        files: LabelFiles,
        chosen: Sequence[int],
        weights: Sequence[float],
        frames: int,
        seed: int,
        *,
        flips: bool,
    ) -> None:
        self._files = files
        self._chosen = np.array(chosen)
        shares = np.cumsum(np.array(weights, np.float64))
        self._ends: npt.NDArray[np.float64] = shares / shares[-1]
        self._frames, self._seed, self._flips = frames, seed, flips

    def __getitem__(self, number: int) -> Window:
        """Draw a window: a sample, a time, an order of its slots, a side."""
        key = np.array([self._seed, number], np.uint64)
        random = np.random.Generator(np.random.Philox(key=key))
        place = int(np.searchsorted(self._ends, random.random(), side="right"))
        index = int(self._chosen[min(place, len(self._chosen) - 1)])
        latest = self._files.length(index) - self._frames
        if latest < 0:
            raise ValueError(
                f"{self._files.examples.table[index]['id']}: has "
                f"{latest + self._frames} frames, a window needs {self._frames}; take "
                "a smaller context, horizon or unroll"
            )
        window = self._files.window(
            index, int(random.integers(latest + 1)), self._frames
        )
        order = 1 + random.permutation(SLOTS)
        labels = shuffled(window.labels, order)
        fields = window.fields.copy()
        fields[order] = window.fields[1:]
        if self._flips and random.random() < 0.5:
            labels = np.ascontiguousarray(labels[..., ::-1])
        return Window(labels, fields)
