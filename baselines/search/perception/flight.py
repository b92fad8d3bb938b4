"""Free flight: velocities of bodies and gravity, from their first poses."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.poses import Poses

Floats = npt.NDArray[np.float64]

# Liquid that spins changes its shape in flight, not the way of its middle: what ends a
# flight is that the way is no parabola.
RIGID: Final = 0.75  # overlap of a body that is still followed well
NEAR: Final = 0.3  # distance from a parabola that is no contact [px]
LEAST: Final = 4  # frames of a flight
SURE: Final = 7  # frames of a flight that tell gravity
LONG: Final = 12  # frames of one that tell it though something else is near
FREELY: Final = 3  # more frames of flights, of all bodies, that tell another one
ALIKE: Final = 0.5  # difference of gravities that two bodies agree on [m/s^2]
STRONGEST: Final = 12.0  # of gravities downward, as they are measured [m/s^2]
WEAKEST: Final = -0.8  # of gravities; what falls slower lies on something [m/s^2]
AT_REST: Final = 0.03  # speed that is none [m/s]
STEP: Final = 1.0  # how much less one step between two frames tells of a speed
SPINS: Final = (0.6, 10.0)  # rates of turn that are one: 1 to 8.4 in train [rad/s]
EARTH: Final = (0.0, -9.8)  # [m/s^2]
WEAK: Final = (0.0, -1.0)  # of 3 % of the train split, exactly [m/s^2]
SAME: Final = {EARTH: 0.7, WEAK: 0.35}  # difference that is none [m/s^2]


@dataclass(frozen=True)
class Flight:
    """How a body flies before it touches anything."""

    velocity: tuple[float, float]
    """At the start [m/s]."""
    spin: float
    """[rad/s]."""
    frames: int
    """That the flight lasts; fewer than `LEAST` tell little."""
    error: float
    """Largest distance from the parabola [px]."""


def flight_of(
    poses: Poses, gravity: Sequence[float], frame_time: float, side: int
) -> Flight:
    """The flight of a body under known gravity [m/s^2]."""
    g = np.asarray(gravity, np.float64)
    last = Flight((0.0, 0.0), 0.0, 1, 0.0)
    for frames in range(2, max(poses.rigid(RIGID), 3) + 1):
        if frames > len(poses):
            break
        time = frame_time * np.arange(frames)
        free = poses.shift[:frames] - np.outer(time**2 / 2, g)
        v = (time @ free) / (time @ time)
        error = float(np.abs(free - np.outer(time, v)).max()) * side
        if frames > 2 and error > NEAR:
            break
        spin = float(time @ poses.turn[:frames] / (time @ time))
        last = Flight((float(v[0]), float(v[1])), spin, frames, error)
    v = np.array(last.velocity)
    if last.frames > 1:
        v[np.abs(v) < AT_REST * (1.0 + STEP / (last.frames - 1))] = 0.0
    spins = SPINS[0] < abs(last.spin) < SPINS[1] and last.frames > 2
    spin = last.spin if spins else 0.0
    return Flight((float(v[0]), float(v[1])), spin, last.frames, last.error)


@dataclass(frozen=True)
class Gravity:
    """Gravity as flights tell it."""

    value: tuple[float, float]
    """[m/s^2]."""
    sure: bool
    """Whether flights tell it, rather than custom."""


def gravity_of(
    flying: Sequence[Poses], frame_time: float, side: int, near: float = NEAR
) -> list[Gravity]:
    """Gravity of bodies that fly, likeliest first; that of the earth is always in it.

    Bodies that start at rest tell it from few frames, others from more; `near` is the
    distance from a parabola that is no contact [px].
    """
    flights = {
        usual: [flight_of(poses, usual, frame_time, side) for poses in flying]
        for usual in SAME
    }
    longest = max((f.frames for f in flights[EARTH]), default=0)
    earth = Gravity(EARTH, sure=longest >= SURE)
    customary = [earth]
    if not earth.sure:  # not that of the earth if free bodies fly otherwise
        freely = {
            usual: sum(
                min(f.frames, p.clear) for f, p in zip(some, flying, strict=True)
            )
            for usual, some in flights.items()
        }
        others = [g for g in SAME if freely[g] > freely[EARTH] + FREELY]
        customary = [*(Gravity(g, sure=False) for g in others), earth]
    found: list[tuple[tuple[bool, float], int, _Fall]] = []
    for number, poses in enumerate(flying):
        for at_rest in (True, False):
            for fall in _free(poses, frame_time, side, near, at_rest=at_rest):
                weight = fall.frames * (1.4 if at_rest else 1.0)
                found.append(((fall.sure, weight), number, fall))
    if not found:
        return customary
    *_, best = max(found, key=lambda each: each[0])
    value = best.value
    for usual, same in SAME.items():
        if math.dist(value, usual) < same:
            value = usual
    if value == EARTH:
        return [earth]
    if best.frames < longest + 2:
        rest = [] if value == customary[0].value else [Gravity(value, sure=False)]
        return [*customary, *rest]
    agreeing = {
        number for _, number, fall in found if math.dist(fall.value, best.value) < ALIKE
    }
    sure = best.sure or best.frames >= LONG or len(agreeing) > 1
    return [Gravity(value, sure=sure), Gravity(EARTH, sure=False)]


@dataclass(frozen=True)
class _Fall:
    """A parabola."""

    clear: bool
    """Whether nothing was near meanwhile."""
    frames: int
    """That it lasts."""
    value: tuple[float, float]
    """Its acceleration [m/s^2]."""

    @property
    def sure(self) -> bool:
        """Whether it tells gravity by itself."""
        return self.clear and self.frames >= SURE


def _free(
    poses: Poses, frame_time: float, side: int, near: float, *, at_rest: bool
) -> Iterator[_Fall]:
    """The longest parabola while nothing else is near, and in any case."""
    best: dict[bool, _Fall] = {}
    least = LEAST if at_rest else LEAST + 2
    for frames in range(least, poses.rigid(RIGID) + 1):
        time = frame_time * np.arange(frames)
        columns = [time**2 / 2] if at_rest else [time**2 / 2, time]
        a = np.stack(columns, axis=1)
        shift = poses.shift[:frames]
        z = np.linalg.lstsq(a, shift, rcond=None)[0]
        error = float(np.abs(shift - a @ z).max()) * side
        if error > near:
            break
        x, y = float(z[0, 0]), float(z[0, 1])
        if -STRONGEST < y < WEAKEST and abs(x) < abs(y):
            clear = frames <= poses.clear
            best[clear] = _Fall(clear, frames, (round(x, 3), round(y, 3)))
    yield from best.values()
