"""What emissions have in common.

The module of an emission has a function of its name, which gives the births of
particles: times (n,) [s], places (n, 2) [m] relative to the center of the nozzle, and
velocities (n, 2) [m/s]. It takes the extent of the nozzle across its velocity [m], the
distance of particles at rest [m], and the `numbers` of the emission.
"""

import math
import sys
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import field_validator

from mpmworlds.sim.program.features.motion import Timed
from mpmworlds.sim.scene.fields import Vec2, about

Floats = npt.NDArray[np.float64]
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0  # steps of a jet's places across its nozzle


class Emission(Timed):
    """What every emission has."""

    DENSE: ClassVar[str] = "the jet is denser than its material"

    rate: float = about(
        "neutral", "particles per time", "1/s", gt=0.0, le=1e6, kind="rate"
    )
    velocity: Vec2 = about("position", "velocity at birth", "m/s", kind="velocity")

    @field_validator("velocity")
    @classmethod
    def _leaves(cls, velocity: tuple[float, float]) -> tuple[float, float]:
        if max(map(abs, velocity)) < 0.05:
            raise ValueError(
                "must be faster than 0.05 m/s, or nothing ever leaves the nozzle"
            )
        return velocity

    def numbers(self) -> tuple[Any, ...]:
        """Numbers that the function of its module takes after width and spacing."""
        return self.rate, self.velocity, self.start, self.stop

    def births(self, width: float, spacing: float) -> tuple[Floats, Floats, Floats]:
        """Times [s], places [m] and velocities [m/s] of births; see the module."""
        module = sys.modules[type(self).__module__]
        name = getattr(self, "type")  # noqa: B009 - every member has one
        found: tuple[Floats, Floats, Floats]
        found = getattr(module, name)(width, spacing, *self.numbers())
        return found

    def count(self, spacing: float) -> int:
        """Number of particles of a spacing at rest [m]."""
        return round(self.rate * (self.stop - self.start))

    def most(self, width: float, spacing: float) -> float:
        """Largest rate [1/s] for a nozzle of a width [m]: area per time over area."""
        return width * math.hypot(*self.velocity) / spacing**2

    def depth(self, width: float) -> float:
        """Extent of the places of birth along the velocity [m]."""
        return 0.0

    def faults(self, width: float, spacing: float) -> Iterator[str]:
        """What is wrong for a nozzle of a width and particles of a spacing [m]."""
        most = self.most(width, spacing)
        if self.count(spacing) == 0:
            yield "emission makes no particle; raise rate or stop"
        if self.rate > most:
            yield (
                f"emission.rate = {self.rate:g}, must be <= {most:.0f}, or "
                f"{self.DENSE}; lower rate or raise size or velocity"
            )
