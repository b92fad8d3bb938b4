"""Pendulums: swinging about a pivot as gravity would make them."""

import math
from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.program.features.motion import POSES, Motion, Pose
from mpmworlds.sim.program.words import (
    hook,
)
from mpmworlds.sim.scene.fields import about


class Pendulum(Motion):
    """Small swings of a shape that hangs from a pivot above its center.

    It starts at rest at an angle and goes on as angle cos(sqrt(9.8 / length) t).
    """

    type: Literal["pendulum"] = about("neutral", "kind of motion")
    length: float = about(
        "neutral", "from pivot to center", "m", gt=0.0, le=1.0, kind="length"
    )
    swing_deg: float = about(
        "neutral", "largest angle", "deg", ge=-45.0, le=45.0, kind="swing"
    )

    def row(self) -> tuple[str, Numbers]:
        """Length, rate and largest angle."""
        numbers = {"length": self.length, "rate": self._rate()}
        return "swing", numbers | {"swing": self.swing_deg}

    def fastest(self, reach: float) -> float:
        """Speed at the lowest point."""
        swing = math.radians(abs(self.swing_deg))
        return self._rate() * swing * (self.length + reach)

    def poses(self) -> list[Pose]:
        """Poses from one end of the swing to the other."""
        most = math.radians(self.swing_deg)
        turns = np.linspace(-most, most, POSES).tolist()
        return [(self._shift(turn), turn) for turn in turns]

    def _shift(self, turn: float) -> tuple[float, float]:
        """Displacement [m] from where the shape hangs at rest."""
        return self.length * math.sin(turn), self.length * (1.0 - math.cos(turn))

    def _rate(self) -> float:
        return float(f"{math.sqrt(9.8 / self.length):.6g}")


@hook.row
def swing(t, x, y, degrees, length, rate, swing):
    cos, sin = unit(rate * t)
    angle, spin = np.radians(swing) * cos, -np.radians(swing) * rate * sin
    along, across = unit(angle)
    cx, cy = x + length * across, y + length * (1.0 - along)
    u, v = length * along * spin, length * across * spin
    return cx, cy, *unit(np.radians(degrees) + angle), u, v, spin
