"""Outlines that many polygons share: alike but for their place, size and mirroring."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Outline = Sequence[Sequence[float]]
"""Corners about the center of a polygon whose area is one."""

FEW: Final = 0.005  # part of all polygons that shares an outline which is left out
ALIKE: Final = 0.03  # of the root of the area: how far corners of one outline differ
COARSE: Final = 2  # digits of corners that are counted together
DIGITS: Final = 5


@dataclass
class _Shared:
    corners: Floats
    count: int


def usual_outlines(
    polygons: Iterable[Sequence[Sequence[float]]],
) -> list[list[list[float]]]:
    """Outlines that many polygons have.

    Parameters
    ----------
    polygons
        Corners of each, about its center.

    Returns
    -------
    list
        Corners (n, 2) of an area of one, counterclockwise, of those that most polygons
        share first.
    """
    counts: Counter[tuple[Any, ...]] = Counter()
    largest: dict[tuple[Any, ...], tuple[float, Floats]] = {}
    for polygon in polygons:
        size, corners = _normal(np.asarray(polygon, np.float64))
        key = tuple(np.round(corners, COARSE).ravel() + 0.0)
        counts[key] += 1
        if size > largest.get(key, (0.0, corners))[0]:  # the most exactly written one
            largest[key] = size, corners
    found: list[_Shared] = []
    for key, count in sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])):
        corners = largest[key][1]
        for shared in found:
            if _alike(shared.corners, corners):
                shared.count += count
                break
        else:
            found.append(_Shared(corners, count))
    found.sort(key=lambda shared: -shared.count)
    least = FEW * counts.total()
    return [
        np.round(shared.corners, DIGITS).tolist()
        for shared in found
        if shared.count > least
    ]


def _normal(corners: Floats) -> tuple[float, Floats]:
    """Root of the area of a polygon, and its corners for an area of one.

    What goes around clockwise is mirrored: scenes mirror polygons corner by corner.
    """
    following = np.roll(corners, -1, axis=0)
    twice = float(np.linalg.det(np.stack([corners, following], axis=1)).sum())
    size = (abs(twice) / 2.0) ** 0.5
    return size, corners * [1.0 if twice > 0.0 else -1.0, 1.0] / size


def _alike(one: Floats, other: Floats) -> bool:
    """Whether corners are the same, wherever the first of them is."""
    return len(one) == len(other) and any(
        np.abs(one - np.roll(other, k, axis=0)).max() < ALIKE for k in range(len(one))
    )
