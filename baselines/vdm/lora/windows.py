"""Windows of training clips: what the k-th one is follows from the seed alone.

So the random state of a training is the number of its step, and neither the number of
workers nor an interruption changes what is seen.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.vdm.canvas import Canvas
from mpmworlds.baselines.vdm.chunks import whole
from mpmworlds.baselines.vdm.memory import PATCH, SPACE, STRIDE
from mpmworlds.baselines.vdm.settings import TrainingSettings
from mpmworlds.baselines.vdm.text import text_for
from mpmworlds.loaders.clips import clip_of
from mpmworlds.loaders.export.folder import Source
from mpmworlds.loaders.load import Examples, side_info_of
from mpmworlds.loaders.weights import sampling_weights
from mpmworlds.metrics.reduction import Frames


class Window(NamedTuple):
    """What one pass through the model sees."""

    frames: Frames
    """uint8 (4 k + 1, H, W, 3), on the canvas of the model."""
    given: int
    """How many of them are known."""
    text: str
    """What is told; empty where the text is dropped."""
    seed: int
    """Of noise and noise level."""


class Windows:
    """Windows of a source, by their number; it goes to workers by fork and by spawn.

    Parameters
    ----------
    source
        The samples; templates are favoured over their perturbations, as in `10k`.
    settings
        Of the training.
    first
        Number of the first window.
    stride
        From one window to the next: the number of processes that share them.
    count
        How many there are.
    """

    def __init__(
        self,
        source: Source,
        settings: TrainingSettings,
        first: int,
        stride: int,
        count: int,
    ) -> None:
        self._source = source
        self._settings = settings
        self._first = first
        self._stride = stride
        self._count = count

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Window:
        number = self._first + self._stride * index
        seeds = np.random.SeedSequence([self._settings.seed, number])
        rng = np.random.Generator(np.random.Philox(seeds))
        total = self._cumulated[-1]
        chosen = int(np.searchsorted(self._cumulated, rng.random() * total, "right"))
        row = self._examples.table[min(chosen, len(self._cumulated) - 1)]
        frames = clip_of(row).frames
        length = min(self._settings.chunk, whole(len(frames)))
        if length <= STRIDE:
            raise ValueError(
                f"{row['id']}: has {len(frames)} frames, must have at least "
                f"{STRIDE + 1} for a window"
            )
        given = min(self._settings.overlap, length - STRIDE)
        start = int(rng.integers(len(frames) - length + 1))
        told = rng.random() >= self._settings.text_dropout
        text = text_for(side_info_of(row, self._examples.regime)) if told else ""
        height, width = frames.shape[1:3]
        canvas = Canvas(height, width, SPACE * PATCH, self._settings.size)
        seed = int(rng.integers(2**62))
        return Window(canvas.put(frames[start : start + length]), given, text, seed)

    @cached_property
    def _examples(self) -> Examples:
        return self._source.load()

    @cached_property
    def _cumulated(self) -> npt.NDArray[np.float64]:
        return np.cumsum(sampling_weights(self._examples.table["kind"]))
