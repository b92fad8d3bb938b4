"""Polygons of usual outlines: a place, an angle and a size instead of all corners."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.outlines import Outline
from mpmworlds.baselines.search.perception.forms import Start
from mpmworlds.baselines.search.perception.pixels import Data, Mask, Pixels, rotation

Floats = npt.NDArray[np.float64]
_Corners = tuple[tuple[float, float], ...]

SECTORS: Final = 120  # that a shape is seen in from its middle
FINEST: Final = 90.0  # pixels a unit of length where outlines are drawn
TRIED: Final = 3  # outlines that a fit starts with
SMALLEST: Final = 0.01  # root of the area of a thing [m]


def outlined(
    mask: Mask, pixels: Pixels, outlines: Sequence[Outline]
) -> Iterator[Start]:
    """Starts of the usual outlines that are most like a mask.

    Each is turned until it reaches as far as the mask in every direction.

    Parameters
    ----------
    mask
        Pixels of a thing (N, N).
    pixels
        Where they are.
    outlines
        The usual ones; their mirror images are usual, too.
    """
    rows, columns = np.nonzero(mask)
    middle, size = pixels.centroid(mask), math.sqrt(pixels.area(mask))
    seen = _reach((pixels.places(rows, columns) - middle) / size)
    views = [_view(outline) for outline in _with_mirrored(outlines)]
    turned = [_turned(seen, view) for view in views]
    step = 1.0 / pixels.side
    for number in sorted(range(len(views)), key=lambda k: turned[k])[:TRIED]:
        view, (_, turn) = views[number], turned[number]
        center = middle - size * rotation(turn) @ view.middle
        numbers = (float(center[0]), float(center[1]), math.degrees(turn), size)
        steps = (step, step, 2.0, 2.0 * step)
        yield Start("polygon", numbers, steps, _drawn(view.outline))


@dataclass(frozen=True, eq=False)
class _View:
    """What is seen of an outline."""

    outline: _Corners
    middle: Floats
    """Of its area, from its center, (2,)."""
    reach: Floats
    """How far it reaches in each sector from there, (SECTORS,)."""


def _with_mirrored(outlines: Sequence[Outline]) -> Iterator[_Corners]:
    for outline in outlines:
        yield tuple((x, y) for x, y in outline)
        yield tuple((-x, y) for x, y in reversed(outline))


@cache
def _view(outline: _Corners) -> _View:
    corners = np.asarray(outline)
    low = corners.min(axis=0)
    at = np.rint((corners - low) * FINEST).astype(np.int32)
    drawn = np.zeros((at[:, 1].max() + 1, at[:, 0].max() + 1), np.uint8)
    cv2.fillPoly(drawn, [at], 1)
    rows, columns = np.nonzero(drawn)
    points = np.stack([columns, rows], axis=1) / FINEST + low
    middle = points.mean(axis=0)
    return _View(outline, middle, _reach(points - middle))


def _reach(points: Floats) -> Floats:
    """The farthest of some points (n, 2) in each sector, (SECTORS,)."""
    angles = np.arctan2(points[:, 1], points[:, 0])
    sectors = np.floor(angles / (2 * np.pi) * SECTORS).astype(int) % SECTORS
    found = np.zeros(SECTORS)
    np.maximum.at(found, sectors, np.hypot(points[:, 0], points[:, 1]))
    return found


def _turned(seen: Floats, view: _View) -> tuple[float, float]:
    """How unlike a view is at best, and the turn at which it is most alike [rad]."""
    unlike = [
        float(((seen - np.roll(view.reach, k)) ** 2).sum()) for k in range(SECTORS)
    ]
    least = int(np.argmin(unlike))
    return unlike[least], 2 * math.pi * least / SECTORS


def _drawn(outline: _Corners) -> Callable[[Sequence[float]], Data]:
    def build(v: Sequence[float]) -> Data:
        size = max(float(v[3]), SMALLEST)
        return {
            "type": "polygon",
            "center": [float(v[0]), float(v[1])],
            "angle_deg": math.remainder(float(v[2]), 360.0),
            "vertices": [[size * x, size * y] for x, y in outline],
        }

    return build
