"""Free flight: velocities of bodies and gravity, from their first poses."""

import math
from collections.abc import Sequence
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
WEAKEST: Final = -0.8  # of gravities; what falls slower lies on something [m/s^2]
AT_REST: Final = 0.03  # speed that is none [m/s]
STEP: Final = 1.0  # how much less one step between two frames tells of a speed
SPINS: Final = 0.25  # rate of turn that is one [rad/s]
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
    spin = last.spin if abs(last.spin) > SPINS and last.frames > 2 else 0.0
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
    flights = [flight_of(poses, EARTH, frame_time, side) for poses in flying]
    longest = max((f.frames for f in flights), default=0)
    earth = Gravity(EARTH, sure=longest >= SURE)
    found = []
    for poses in flying:
        for at_rest in (True, False):
            told = _free(poses, frame_time, side, near, at_rest=at_rest)
            if told is not None:
                found.append((told[0] * (1.4 if at_rest else 1.0), *told))
    if not found:
        return [earth]
    _, frames, value = max(found, key=lambda each: each[0])
    for usual, same in SAME.items():
        if math.dist(value, usual) < same:
            value = usual
    if value == EARTH:
        return [earth]
    if frames < longest + 2:
        return [earth, Gravity(value, sure=False)]
    return [Gravity(value, sure=frames >= SURE), Gravity(EARTH, sure=False)]


def _free(
    poses: Poses, frame_time: float, side: int, near: float, *, at_rest: bool
) -> tuple[int, tuple[float, float]] | None:
    """Frames of the longest parabola, and its acceleration [m/s^2]."""
    best = None
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
        if -12.0 < y < WEAKEST and abs(x) < abs(y):
            best = frames, (round(x, 3), round(y, 3))
    return best
