"""Frames as labels: which colour of the palette each pixel has.

A clip that was compressed again has fringes of other colours; pixels go to the nearest
colour among those that fill areas somewhere.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.scene.palette import PALETTE, rgb

Numbers = npt.NDArray[np.int16]

EXACT: Final = 0.995  # share of pixels that tells a clip that nobody recompressed
LEAST_PIXELS: Final = 12  # of a colour in one frame, for it to be there
MOST_COLORS: Final = 16  # a scene of more than so many colours was never made
_COLORS: Final = tuple(PALETTE.values())
_RGB: Final = np.array([(0, 0, 0), *(rgb(color) for color in _COLORS)], np.int32)
_PACK: Final = np.array([65536, 256, 1], np.int32)


@dataclass(frozen=True, eq=False)
class Labels:
    """Frames whose pixels have numbers for colours."""

    numbers: Numbers
    """(T, N, N); 0 is background, k the colour ``colors[k - 1]``."""
    colors: tuple[str, ...]
    """Colours that are there, by their numbers in the palette."""
    exact: float
    """Share of pixels that had exactly a colour of the palette."""

    def masks(self, color: str) -> npt.NDArray[np.bool_]:
        """Where a colour is, (T, N, N)."""
        found: npt.NDArray[np.bool_] = self.numbers == 1 + self.colors.index(color)
        return found


def labels_of(frames: Frames) -> Labels:
    """Label the pixels of frames, uint8 (T, N, N, 3).

    Raises
    ------
    ValueError
        If there are no frames, they are not square, or nothing is in them.
    """
    if frames.ndim != 4 or not len(frames) or frames.shape[1] != frames.shape[2]:
        raise ValueError(
            f"clip has shape {frames.shape}, must be (T, N, N, 3) with a frame at least"
        )
    packed = frames.astype(np.int32) @ _PACK
    codes, inverse, counts = np.unique(packed, return_inverse=True, return_counts=True)
    seen = np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=1)
    nearest, distance = _nearest(seen, np.arange(len(_RGB)))
    exact = float(counts[distance == 0].sum() / counts.sum())
    kept = _filling(nearest[inverse].reshape(packed.shape), eroded=exact < EXACT)
    if not len(kept):
        raise ValueError("clip shows nothing but background; there is nothing to find")
    nearest, _ = _nearest(seen, np.array([0, *kept]))
    return Labels(
        nearest[inverse].reshape(packed.shape).astype(np.int16),
        tuple(_COLORS[number - 1] for number in kept),
        exact,
    )


def _nearest(
    seen: npt.NDArray[np.int32], among: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Place of the nearest of some colours, and its squared distance."""
    best = np.zeros(len(seen), np.int64)
    least = np.full(len(seen), np.iinfo(np.int64).max)
    for place, number in enumerate(among):
        distance = ((seen - _RGB[number]).astype(np.int64) ** 2).sum(axis=1)
        best[distance < least] = place
        least = np.minimum(least, distance)
    return best, least


def _filling(numbers: npt.NDArray[np.int64], *, eroded: bool) -> list[int]:
    """Colours that fill an area in some frame, at most `MOST_COLORS` of them."""
    most = np.zeros(len(_RGB), np.int64)
    for frame in numbers:
        for number in np.unique(frame[frame > 0]):
            mask = (frame == number).astype(np.uint8)
            if eroded:  # fringes are thin
                mask = cv2.erode(mask, np.ones((3, 3), np.uint8))
            most[number] = max(most[number], int(mask.sum()))
    ranked = sorted(np.nonzero(most >= LEAST_PIXELS)[0], key=lambda k: -int(most[k]))
    return sorted(int(number) for number in ranked[:MOST_COLORS])
