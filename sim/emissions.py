"""What leaves a nozzle: a jet, a swinging jet, or drops.

The function of `physics.emission` of the same name as a type gives times, places and
velocities of birth. The methods here tell checks how many particles there are, how
dense, and how much room they need.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, field_validator

from mpmworlds.sim.motions import Timed
from mpmworlds.sim.scene.fields import Vec2, about

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0  # steps of a jet's places across its nozzle
NEIGHBORS = np.arange(1, 1000)  # drops after one that may be near to it


class Emission(Timed):
    """What every emission has."""

    DENSE: ClassVar[str] = "the jet is denser than its material"

    rate: float = about("neutral", "particles per time", "1/s", gt=0.0, le=1e6)
    velocity: Vec2 = about("position", "velocity at birth", "m/s")

    @field_validator("velocity")
    @classmethod
    def _leaves(cls, velocity: tuple[float, float]) -> tuple[float, float]:
        if max(map(abs, velocity)) < 0.05:
            raise ValueError(
                "must be faster than 0.05 m/s, or nothing ever leaves the nozzle"
            )
        return velocity

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


class Jet(Emission):
    """A jet of particles that leaves the nozzle evenly in space and time."""

    type: Literal["jet"] = about("neutral", "kind of emission", default="jet")


class Hose(Emission):
    """A jet whose direction swings about that of its velocity, first to the left."""

    type: Literal["hose"] = about("neutral", "kind of emission")
    swing_deg: float = about(
        "neutral", "amplitude of direction", "deg", ge=-90.0, le=90.0
    )
    period: float = about("neutral", "time of a swing to and fro", "s", ge=0.02, le=100)

    def most(self, width: float, spacing: float) -> float:
        """As of a jet, less what the inner edge of the nozzle loses to its turn."""
        speed = math.hypot(*self.velocity)
        spin = 2.0 * math.pi / self.period * math.radians(abs(self.swing_deg))
        return width * max(speed - 0.5 * spin * width, 0.0) / spacing**2

    def depth(self, width: float) -> float:
        """That of the nozzle when it is turned most."""
        return width * math.sin(math.radians(abs(self.swing_deg)))


class Rain(Emission):
    """Round drops of particles, spread evenly across the nozzle and over time."""

    DENSE = "drops overlap"

    type: Literal["rain"] = about("neutral", "kind of emission")
    drop_radius: float = about("neutral", "radius of a drop", "m", ge=0.002, le=0.2)

    def drop(self, spacing: float) -> int:
        """Particles in a drop."""
        return max(round(math.pi * self.drop_radius**2 / spacing**2), 1)

    def count(self, spacing: float) -> int:
        """Number of particles: those of all drops."""
        drops = round(self.rate / self.drop(spacing) * (self.stop - self.start))
        return drops * self.drop(spacing)

    def most(self, width: float, spacing: float) -> float:
        """Rate at which a drop touches one of those after it, if not denser than a jet.

        Drops n apart differ by n GOLDEN mod 1 across and by n steps along the velocity.
        """
        gap = 2.0 * self.drop_radius
        aside = abs((NEIGHBORS * GOLDEN + 0.5) % 1.0 - 0.5) * (width - gap)
        step = float(np.max(np.sqrt((gap**2 - aside**2).clip(0.0)) / NEIGHBORS))
        apart = self.drop(spacing) * math.hypot(*self.velocity) / step
        return min(apart, super().most(width, spacing))

    def depth(self, width: float) -> float:
        """That of a drop."""
        return 2.0 * self.drop_radius

    def faults(self, width: float, spacing: float) -> Iterator[str]:
        """A nozzle that is too narrow, else as of a jet."""
        if width < 2.0 * self.drop_radius:
            yield (
                f"emission.drop_radius = {self.drop_radius:g}, must be <= "
                f"{0.5 * width:g}, half of the nozzle across the velocity; lower it or "
                "raise shape.size"
            )
        else:
            yield from super().faults(width, spacing)


def _typed(data: Any) -> Any:
    """An emission that does not say of which type it is, is a jet."""
    return {"type": "jet"} | data if isinstance(data, dict) else data


AnyEmission = Annotated[
    Annotated[Hose | Jet | Rain, Field(discriminator="type")], BeforeValidator(_typed)
]
EMISSIONS: dict[str, type[Emission]] = {"hose": Hose, "jet": Jet, "rain": Rain}
