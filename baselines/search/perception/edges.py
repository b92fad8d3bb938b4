"""Whether the edge of a body is sharp, or grainy as that of scattered particles.

Bodies of a mesh and rigid ones are drawn along their outline. All others are drawn
particle by particle, which lie at random: a seventh of the pixels along their outline
is on the wrong side of it.
"""

from enum import Enum
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.perception.pixels import (
    Data,
    Floats,
    Mask,
    Pixels,
    distances,
)

SHARP: Final = 0.035  # wrong pixels a pixel of outline: rigid bodies .03 at most
GRAINY: Final = 0.09  # the same: bodies of a mesh .09 at most, particles .05 to .3
FEW: Final = 6  # wrong pixels that may be of a sharp edge in any case
LONG: Final = 60  # pixels of an outline that tells
NEAR: Final = 3.0  # pixels from the outline within which they count [px]
OFFSETS: Final = np.arange(-0.5, 1.05, 0.05)  # by how much it is drawn larger [px]


class Edge(Enum):
    """How the edge of a body looks."""

    SHARP = "sharp"
    GRAINY = "grainy"
    UNCLEAR = "unclear"


def edge_of(mask: Mask, care: Mask, pixels: Pixels, *shapes: Data) -> Edge:
    """How the edge of a mask looks, by the shape that fits it best.

    Parameters
    ----------
    mask, care
        Pixels of a body (N, N), and those that tell anything.
    pixels
        Where they are.
    shapes
        That it may have, to within an even offset.
    """
    wrong, length = min(
        (_wrong(mask, care, pixels, shape) for shape in shapes),
        key=lambda found: found[0] / found[1],
    )
    if wrong >= max(GRAINY * length, FEW):
        return Edge.GRAINY
    if length >= LONG and wrong <= SHARP * length:
        return Edge.SHARP
    return Edge.UNCLEAR


def _wrong(mask: Mask, care: Mask, pixels: Pixels, shape: Data) -> tuple[int, float]:
    """Pixels on the wrong side of an outline, and how long that is [px]."""
    x, y = pixels.centers()
    d: Floats = pixels.side * distances(shape, x[None, :], y[:, None])
    near = (np.abs(d) < NEAR) & care
    d, inside = d[near], mask[near]
    wrong: Any = np.count_nonzero(inside != (d < OFFSETS[:, None]), axis=1)
    return int(wrong.min()), max(float(np.count_nonzero(np.abs(d) < 0.5)), 1.0)
