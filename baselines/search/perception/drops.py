"""Drops one by one: where they were born, how fast they leave, how large they are."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.flow import Hit
from mpmworlds.baselines.search.perception.pixels import Pixels
from mpmworlds.baselines.search.perception.poses import Poses

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

FLIGHT: Final = 5  # frames of a drop that tells gravity
FAR: Final = 12.0  # pixels that it goes: what has landed tells none
MOST_FLIGHTS: Final = 6
FEW: Final = 2  # births that tell no rate
LEAST_FLIGHT: Final = 3  # frames of a drop that tells where it was born
MOST_FITTED: Final = 5
ALIKE: Final = 0.4  # difference from the velocity of the first drops at most [m/s]
MORE_ALIKE: Final = 0.25  # the same beneath what was hit [m/s]
SAME: Final = 0.01  # distance of one drop from itself at most [m]
LEAST: Final = 12  # pixels of a drop
COMPACT: Final = 0.6  # part of its box that a drop fills
WHOLE: Final = 1.35  # growth in a frame of what does not come out little by little
NEAR: Final = 5.0  # how far a drop is from where it is expected [px]
NEAR_AT_FIRST: Final = 16.0  # the same, before its velocity is known [px]
DRAWN_LARGER: Final = 0.2  # by the drawing, all around [px]


@dataclass
class _Drop:
    frames: list[int]
    places: list[Floats]
    areas: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Drops:
    """What drops tell of their nozzle."""

    velocity: tuple[float, float]
    """At birth [m/s]."""
    births: tuple[tuple[float, float, float], ...]
    """Time [s] and place [m] of each drop when it is seen first, in order."""
    radius: float
    """[m]."""
    steady: bool
    """Whether they have the form and the number of drops, rather than of a jet."""


def drops_of(
    masks: Mask,
    pixels: Pixels,
    gravity: Sequence[float],
    frame_time: float,
    hit: Hit,
) -> Drops | None:
    """Follow compact pieces through frames; None if there are none."""
    free = np.stack([m & ~hit.beneath(pixels, k) for k, m in enumerate(masks)])
    found = [d for d in _followed(free, pixels) if len(d.frames) >= LEAST_FLIGHT]
    found = found or _at_once(masks, pixels)
    if not found:
        return None
    area = float(np.median([max(d.areas) for d in found]))
    found = [d for d in found if max(d.areas) < 2.2 * area]
    all_ = sorted((_born(d, gravity, frame_time) for d in found), key=_Birth.when)
    # What has landed looks like a drop that is thrown up; the first ones have not.
    first = [b.velocity for b in all_ if b.time == all_[0].time]
    leaving = np.median(first, axis=0)
    births = [b for b in all_ if _apart(b.velocity, leaving) < ALIKE] or all_
    if len(births) < FEW:
        whole = [
            _born(d, gravity, frame_time)
            for d in _followed(masks, pixels)
            if len(d.frames) >= LEAST_FLIGHT and d.areas[0] / WHOLE < area
            if d.areas[0] > (2.0 - WHOLE) * area
        ]
        births = sorted(
            [*births, *_others(births, whole, frame_time, MORE_ALIKE)], key=_Birth.when
        )
    velocity = np.mean([b.velocity for b in births], axis=0)
    return _told(births, velocity, area, pixels, steady=_are_drops(masks, found))


def all_drops_of(
    masks: Mask, pixels: Pixels, gravity: Sequence[float], frame_time: float
) -> Drops | None:
    """Drops that leave alike, wherever they are; None if there are none.

    Contacts may be taken for what they are not: a drop falls along a wall, or behind
    something, and what spoils nothing spoils all.
    """
    found = [d for d in _followed(masks, pixels) if len(d.frames) >= LEAST_FLIGHT]
    if not found:
        return None
    area = float(np.median([max(d.areas) for d in found]))
    whole = [d for d in found if area / WHOLE < d.areas[0] < area * WHOLE]
    all_ = sorted((_born(d, gravity, frame_time) for d in whole), key=_Birth.when)
    alike = [
        [b for b in all_ if _apart(b.velocity, one.velocity) < ALIKE] for one in all_
    ]
    known = max(alike, key=len, default=[])
    if not known:
        return None
    # Others that begin where these do were only slowed down.
    others = _others(known, all_, frame_time, math.inf)
    births = sorted([*known, *others], key=_Birth.when)
    velocity = np.mean([b.velocity for b in known], axis=0)
    return _told(births, velocity, area, pixels, steady=_are_drops(masks, found))


@dataclass(frozen=True, eq=False)
class _Birth:
    """A drop when it is seen first."""

    time: float
    """[s]."""
    place: Floats
    """[m]."""
    velocity: Floats
    """[m/s]."""

    def when(self) -> float:
        """Its time [s]."""
        return self.time


def _told(
    births: Sequence[_Birth],
    velocity: Floats,
    area: float,
    pixels: Pixels,
    *,
    steady: bool,
) -> Drops:
    radius = math.sqrt(area / math.pi) - DRAWN_LARGER
    return Drops(
        (float(velocity[0]), float(velocity[1])),
        tuple((b.time, float(b.place[0]), float(b.place[1])) for b in births),
        radius / pixels.side,
        steady=steady,
    )


def _born(drop: _Drop, gravity: Sequence[float], frame_time: float) -> _Birth:
    count = min(len(drop.frames), MOST_FITTED)
    time = frame_time * np.arange(count)
    free = np.array(drop.places[:count]) - np.outer(time**2 / 2, gravity)
    a = np.stack([np.ones(count), time], axis=1)
    (place, velocity), *_ = np.linalg.lstsq(a, free, rcond=None)
    return _Birth(drop.frames[0] * frame_time, place, velocity)


def _others(
    known: Sequence[_Birth], whole: Sequence[_Birth], frame_time: float, alike: float
) -> Iterator[_Birth]:
    """Drops like those that are known, beneath a place that something has hit.

    They begin where those do, and leave about as they do: to `alike` [m/s].
    """
    velocity = np.mean([b.velocity for b in known], axis=0)
    speed = float(np.hypot(*velocity))
    ahead = velocity / max(speed, 1e-6)
    levels = [float(b.place @ ahead) for b in known]
    low, high = min(levels) - speed * frame_time, max(levels) + speed * frame_time
    for birth in whole:
        here = low < float(birth.place @ ahead) < high
        seen = any(
            birth.time == b.time and _apart(birth.place, b.place) <= SAME for b in known
        )
        if here and not seen and _apart(birth.velocity, velocity) < alike:
            yield birth


def _apart(one: Floats, other: Floats) -> float:
    return float(np.hypot(*(one - other)))


def _are_drops(masks: Mask, found: Sequence[_Drop]) -> bool:
    """Whether the first frames show as many pixels as drops have, and one of them."""
    first = int(np.argmax(masks.any(axis=(1, 2))))
    if all(drop.frames[0] > first for drop in found):
        return False
    seen = [float(masks[k].sum()) for k in range(first, min(first + 4, len(masks)))]
    grows = len(seen) > 2 and seen[2] > 1.6 * seen[1] > 2.2 * seen[0]
    return len(found) >= 3 or (len(found) >= 1 and not grows)


def _at_once(masks: Mask, pixels: Pixels) -> list[_Drop]:
    """What is there as a whole when it is seen first, though something is near it."""
    first = int(np.argmax(masks.any(axis=(1, 2))))
    found = _followed(masks[first : first + 3], pixels)
    for drop in found:
        drop.frames = [first + k for k in drop.frames]
    return [
        drop
        for drop in found
        if len(drop.frames) > 1
        and drop.frames[0] == first
        and drop.areas[1] < WHOLE * drop.areas[0]
    ]


def _followed(masks: Mask, pixels: Pixels) -> list[_Drop]:
    all_: list[_Drop] = []
    scale = 1.0 / pixels.side
    for number, mask in enumerate(masks):
        free = _compact(mask, pixels)
        for drop in all_:
            if drop.frames[-1] != number - 1 or not free:
                continue
            expected, near = drop.places[-1], NEAR_AT_FIRST
            if len(drop.places) > 1:
                expected, near = 2 * expected - drop.places[-2], NEAR
            k = int(np.argmin([np.hypot(*(place - expected)) for place, _ in free]))
            place, area = free[k]
            ratio = area / drop.areas[-1]
            if np.hypot(*(place - expected)) < near * scale and 0.6 < ratio < 1.7:
                drop.frames.append(number)
                drop.places.append(place)
                drop.areas.append(area)
                del free[k]
        all_ += [_Drop([number], [place], [area]) for place, area in free]
    return all_


def _compact(mask: Mask, pixels: Pixels) -> list[tuple[Floats, float]]:
    count, _, stats, centers = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    found = []
    for k in range(1, count):
        _, _, w, h, area = (int(v) for v in stats[k])
        if area >= LEAST and area > COMPACT * w * h and 0.65 < w / h < 1.55:
            place = pixels.places(centers[k][1], centers[k][0])
            found.append((place, float(area)))
    return found


def flights_of_drops(masks: Mask, pixels: Pixels) -> list[Poses]:
    """Drops that fly for some frames, as poses, the longest flights first."""
    found = [
        d
        for d in _followed(masks, pixels)
        if len(d.frames) >= FLIGHT
        and np.hypot(*(d.places[-1] - d.places[0])) > FAR / pixels.side
    ]
    found.sort(key=lambda d: -len(d.frames))
    return [
        Poses(
            np.array(drop.places) - drop.places[0],
            np.zeros(len(drop.places)),
            np.ones(len(drop.places)),
            len(drop.places),
        )
        for drop in found[:MOST_FLIGHTS]
    ]
