"""The order of drops: each is born a golden step aside from the one before."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.sim.program.features.emission import GOLDEN

Floats = npt.NDArray[np.float64]

MANY_DROPS: Final = 5  # that tell their numbers by their places
# Times between drops to try, in those between drops that are seen: from, to, how many.
GAPS: Final = (0.5, 1.15, 240)
LONGER: Final = 2.2  # time between drops over that of the first one, at most, and
SURE: Final = 0.02  # how well that is known [s]
FIRST_DROPS: Final = 3  # numbers that the first one that is seen may have


def numbered(born: Floats, side: Floats, seen: float) -> tuple[Floats, float]:
    """Numbers of drops, and the time between two of them [s].

    Parameters
    ----------
    born
        Times of their births, in order (n,) [s].
    side
        Where they are across the nozzle (n,) [m].
    seen
        How long the nozzle was seen [s].
    """
    if len(born) >= MANY_DROPS and (found := _in_golden_order(born, side)) is not None:
        return found
    return _one_after_the_other(born, seen)


def _one_after_the_other(born: Floats, seen: float) -> tuple[Floats, float]:
    """The same by their births alone.

    The first drop comes after half of the time between two, so that this is at most
    twice its time: where it seems to be more, some were cut before they were seen.
    """
    first = float(born[0])
    if len(born) == 1:  # the next one is not born yet, unless it was cut
        return np.zeros(1), max(min(max(seen - first, first), 2.0 * first), 0.02)
    gaps = np.diff(born)
    gap = max(float(np.median(gaps)), 0.004)
    numbers = np.arange(len(born), dtype=np.float64)
    if gap > (most := LONGER * first + SURE):
        gap = max(float(gaps.min()), 0.004)
        gap /= math.ceil(gap / most)
        numbers = np.rint((born - first) / gap)
    for _ in range(3):
        slope = float(np.polyfit(numbers, born, 1)[0])
        if slope <= 0.0:
            break
        gap = slope
        numbers = np.maximum.accumulate(np.rint((born - born[0]) / gap))
    return numbers, gap


def _in_golden_order(born: Floats, side: Floats) -> tuple[Floats, float] | None:
    """Numbers of many drops and the time between two of them, by where they are.

    Of times that are about the mean one, that by which places are in golden steps.
    """
    order = np.argsort(born, kind="stable")
    born, side = born[order], side[order]
    mean = float(born[-1] - born[0]) / (len(born) - 1)
    best = None
    for gap in mean * np.geomspace(*GAPS):
        for first in range(FIRST_DROPS):
            numbers = np.rint((born - born[0]) / gap) + first
            (_, width), expected = _line(side, numbers)
            off = float(np.median(np.abs(side - expected)))
            if width > 0.0 and (best is None or off < best[0]):
                best = off, numbers, float(gap)
    if best is None:
        return None
    back = np.empty(len(born))
    back[order] = best[1]
    return back, best[2]


def spread(side: Floats, numbers: Floats, usual: float) -> tuple[float, float]:
    """Middle and extent of places across a nozzle, of drops by their numbers.

    One drop tells no extent: it is the usual one then [m].
    """
    if len(side) > 1:
        (middle, width), _ = _line(side, numbers)
        if 0.0 < width < 0.9:
            return float(middle), float(width)
    width = max(usual, 1.2 * float(np.ptp(side)))
    return float((side - width * _parts(numbers)).mean()), width


def _line(side: Floats, numbers: Floats) -> tuple[Floats, Floats]:
    """Middle and extent of a nozzle by places across it, and where drops are then."""
    columns = np.stack([np.ones(len(side)), _parts(numbers)], axis=1)
    fit = np.asarray(np.linalg.lstsq(columns, side, rcond=None)[0], np.float64)
    return fit, np.asarray(columns @ fit, np.float64)


def _parts(numbers: Floats) -> Floats:
    """Places of drops across their nozzle, in parts of its width from the middle."""
    found: Floats = numbers * GOLDEN % 1.0 - 0.5
    return found
