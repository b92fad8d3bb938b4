"""Translation at a constant velocity."""

import math
from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.program.features.motion import REST, Motion, Pose
from mpmworlds.sim.program.words import (
    hook,
)
from mpmworlds.sim.scene.fields import Vec2, about


class Translate(Motion):
    """Constant velocity between two times, at rest before and after."""

    type: Literal["translate"] = about("neutral", "kind of motion")
    velocity: Vec2 = about(
        "position", "velocity while it moves", "m/s", kind="velocity"
    )

    def row(self) -> tuple[str, Numbers]:
        """Velocity."""
        u, v = self.velocity
        timing = {"start": self.start, "stop": self.stop}
        return "translate", {"u": u, "v": v} | timing

    def fastest(self, reach: float) -> float:
        """The speed."""
        return math.hypot(*self.velocity)

    def poses(self) -> list[Pose]:
        """Both ends of the way."""
        time = self.stop - self.start
        return [REST, ((self.velocity[0] * time, self.velocity[1] * time), 0.0)]


@hook.row
def translate(t, x, y, degrees, u, v, start, stop):
    time, moving = min(max(t, start), stop) - start, float(start <= t < stop)
    cx, cy = x + u * time, y + v * time
    return cx, cy, *unit(np.radians(degrees)), u * moving, v * moving, 0.0
