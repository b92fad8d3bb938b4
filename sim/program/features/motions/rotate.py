"""Rotation at a constant rate."""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.program.features.motion import POSES, Motion, Pose
from mpmworlds.sim.program.words import (
    hook,
)
from mpmworlds.sim.scene.fields import about


class Rotate(Motion):
    """Constant spin about the center of the shape."""

    type: Literal["rotate"] = about("neutral", "kind of motion")
    angular_velocity: float = about(
        "neutral", "spin", "rad/s", ge=-100.0, le=100.0, kind="spin"
    )

    def row(self) -> tuple[str, Numbers]:
        """Spin."""
        numbers = {"spin": self.angular_velocity} | self.timing()
        return ("rotate_for_a_time" if self.is_timed() else "rotate"), numbers

    def fastest(self, reach: float) -> float:
        """Speed of the tip."""
        return abs(self.angular_velocity) * reach

    def poses(self) -> list[Pose]:
        """Turns up to a full one."""
        turn = self.angular_velocity * (self.stop - self.start)
        turns = np.linspace(0.0, max(min(turn, 2 * np.pi), -2 * np.pi), POSES)
        return [((0.0, 0.0), angle) for angle in turns.tolist()]


@hook.row
def rotate(t, x, y, degrees, spin):
    return x, y, *unit(np.radians(degrees) + spin * t), 0.0, 0.0, spin


@hook.row
def rotate_for_a_time(t, x, y, degrees, spin, start, stop):
    time, moving = min(max(t, start), stop) - start, float(start <= t < stop)
    return x, y, *unit(np.radians(degrees) + spin * time), 0.0, 0.0, spin * moving
