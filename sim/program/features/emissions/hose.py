"""Jets that swing."""

import math
from typing import Any, Literal

import numpy as np

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.emission import Emission
from mpmworlds.sim.program.features.emissions.jet import jet
from mpmworlds.sim.scene.fields import about


class Hose(Emission):
    """A jet whose direction swings about that of its velocity, first to the left."""

    type: Literal["hose"] = about("neutral", "kind of emission")
    swing_deg: float = about(
        "neutral", "amplitude of direction", "deg", ge=-90.0, le=90.0, kind="swing"
    )
    period: float = about(
        "neutral", "time of a swing to and fro", "s", ge=0.02, le=100, kind="time"
    )

    def numbers(self) -> tuple[Any, ...]:
        """Those of a jet, swing and period."""
        return *super().numbers(), self.swing_deg, self.period

    def most(self, width: float, spacing: float) -> float:
        """As of a jet, less what the inner edge of the nozzle loses to its turn."""
        speed = math.hypot(*self.velocity)
        spin = 2.0 * math.pi / self.period * math.radians(abs(self.swing_deg))
        return width * max(speed - 0.5 * spin * width, 0.0) / spacing**2

    def depth(self, width: float) -> float:
        """That of the nozzle when it is turned most."""
        return width * math.sin(math.radians(abs(self.swing_deg)))


def hose(width, spacing, rate, velocity, start, stop, swing, period):
    """Births of a jet that swings by some degrees to both sides, sinusoidally."""
    time, *vectors = jet(width, spacing, rate, velocity, start, stop)
    phase = 2 * np.pi * (time - start) / period
    angle = [np.radians(swing) * unit(each)[1] for each in phase]
    cos, sin = np.transpose([unit(each) for each in angle])
    return time, *(
        np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
        for x, y in map(np.transpose, vectors)
    )
