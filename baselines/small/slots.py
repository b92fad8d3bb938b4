"""Frames as labels of slots: which of the colours of the prefix each pixel has.

A colour only says which pixels belong together; a model that sees slots in any order
learns no colour. What a frame of a scene shows is exact in labels, and in no other form
as small.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.scene.palette import PALETTE, rgb

SLOTS: Final = 8  # colours of a prefix at most; label 0 is background
CLASSES: Final = SLOTS + 1
UNKNOWN: Final = 255  # label of a pixel whose colour the prefix has not shown
_PACK: Final = np.array([65536, 256, 1], np.int32)

LabelFrames = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Slots:
    """The colours of a prefix, in the order of their area, the largest first."""

    colors: tuple[str, ...]
    """Colours of the palette, at most `SLOTS`."""

    @classmethod
    def of(cls, prefix: Frames) -> Self:
        """Find the colours of a prefix, uint8 (T, N, N, 3), recompressed or not."""
        if not prefix.any():
            return cls(())
        found = labels_of(prefix)
        areas = np.bincount(found.numbers.ravel(), minlength=1 + len(found.colors))[1:]
        order = np.argsort(-areas, kind="stable")[:SLOTS]
        return cls(tuple(found.colors[k] for k in order))

    @property
    def pictures(self) -> npt.NDArray[np.uint8]:
        """Colour of each label, uint8 (1 + len(colors), 3), background first."""
        return np.array([(0, 0, 0), *map(rgb, self.colors)], np.uint8)

    def labels(self, frames: Frames) -> LabelFrames:
        """Label frames: each pixel gets the label of the nearest colour.

        Parameters
        ----------
        frames
            uint8 (T, N, N, 3).

        Returns
        -------
        ndarray
            uint8 (T, N, N): 0 is background, k is ``colors[k - 1]``, `UNKNOWN` is
            nearest to a colour of the palette that the prefix has not shown.
        """
        packed = frames.astype(np.int32) @ _PACK
        codes, inverse = np.unique(packed, return_inverse=True)
        seen = np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=1)
        every = ["#000000", *PALETTE.values()]
        gaps = seen[:, None] - np.array([rgb(color) for color in every])
        nearest = (gaps**2).sum(axis=2).argmin(axis=1)
        label = np.full(len(every), UNKNOWN, np.uint8)
        label[0] = 0
        for number, color in enumerate(self.colors, 1):
            label[every.index(color)] = number
        found: LabelFrames = label[nearest][inverse].reshape(packed.shape)
        return found

    def frames(self, labels: LabelFrames) -> Frames:
        """Colour labels, uint8 (T, N, N); what has no slot becomes background."""
        colors = np.zeros((256, 3), np.uint8)
        colors[: 1 + len(self.colors)] = self.pictures
        return colors[labels]


def shuffled(
    labels: LabelFrames, order: Sequence[int] | npt.NDArray[np.int64]
) -> LabelFrames:
    """Labels whose slots have another order.

    Parameters
    ----------
    labels
        uint8, of any shape.
    order
        New slot of each of the `SLOTS` slots, each of 1..SLOTS once.
    """
    table = np.arange(256, dtype=np.uint8)
    table[1:CLASSES] = order
    return table[labels]
