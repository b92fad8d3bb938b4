"""Outlines: lists of polygons, each (n, 2) [m], that together cover a shape."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Corners = npt.NDArray[np.float64]
Outline = list[Corners]
CHORD = 2 * math.pi / 96  # angle between corners of an outline that is round [rad]


def rectangle(size: tuple[float, float]) -> Corners:
    """Corners (4, 2) of a rectangle, counter-clockwise from the lower left one."""
    return 0.5 * np.array(size) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]


def arc(radius: float, start: float, stop: float) -> Corners:
    """Points (n, 2) near an arc whose chords enclose the area of its sector."""
    count = max(round(abs(stop - start) / CHORD), 1)
    step = (stop - start) / count
    angle = start + step * np.arange(count + 1)
    far = radius * math.sqrt(step / math.sin(step))
    return far * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def stadium(start: float, stop: float, radius: float) -> Corners:
    """Outline (n, 2) of what is within a radius of the x axis from start to stop."""
    end = arc(radius, -0.5 * np.pi, 0.5 * np.pi)
    return np.concatenate([end + [stop, 0.0], [start, 0.0] - end])


def centroid(outline: Outline) -> Corners:
    """Center of area (2,) of polygons that overlap nowhere, or alike all around."""
    total, moment = 0.0, np.zeros(2)
    for p in outline:
        q = np.roll(p, -1, axis=0)
        twice = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
        area = 0.5 * abs(twice.sum())
        total += area
        moment += area * (twice @ (p + q)) / (3.0 * twice.sum())
    return np.asarray(moment / total)


def paint(
    image: npt.NDArray[np.uint8],
    outline: Outline,
    color: Sequence[int],
    scale: int,
    start: Sequence[int] = (0, 0),
) -> None:
    """Fill polygons in an image whose pixel (0, 0) is pixel `start` of the domain.

    `scale` is the number of pixels a metre; rows are in the direction of y.
    """
    import cv2  # here, because reading a schema should not load it

    for polygon in outline:
        corners = np.rint((polygon.clip(-1.0, 2.0) * scale - start) * 16 - 8)
        cv2.fillPoly(image, [corners.astype(np.int32)], color, shift=4)


def crosses_itself(p: Corners) -> bool:
    """Whether two edges of a closed polygon (n, 2) that are not neighbours meet."""

    def side(a: Corners, b: Corners, i: int) -> float:
        ab, ac = b - a, p[i % len(p)] - a
        return float(np.sign(ab[0] * ac[1] - ab[1] * ac[0]))

    n = len(p)
    for i in range(n):
        for j in range(i + 2, n - (i == 0)):
            a, b, c, d = p[i], p[(i + 1) % n], p[j], p[(j + 1) % n]
            if (
                side(a, b, j) != side(a, b, j + 1)
                and side(c, d, i) != side(c, d, i + 1)
            ):  # fmt: skip
                return True
    return False
