"""Rain: drops."""

import math
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.emission import GOLDEN, Emission
from mpmworlds.sim.program.features.emissions.jet import jet
from mpmworlds.sim.scene.fields import about

NEIGHBORS = np.arange(1, 1000)  # drops after one that may be near to it


class Rain(Emission):
    """Round drops of particles, spread evenly across the nozzle and over time."""

    DENSE = "drops overlap"

    type: Literal["rain"] = about("neutral", "kind of emission")
    drop_radius: float = about(
        "neutral", "radius of a drop", "m", ge=0.002, le=0.2, kind="length"
    )

    def numbers(self) -> tuple[Any, ...]:
        """Those of a jet, and the radius of drops."""
        return *super().numbers(), self.drop_radius

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


def rain(width, spacing, rate, velocity, start, stop, radius):
    """Births of drops, whose centers make a jet: spirals of particles [Vogel 1979]."""
    count = max(round(np.pi * radius**2 / spacing**2), 1)
    part = np.arange(count) + 0.5
    drop = radius * np.sqrt(part / count) * unit(np.pi * (3 - np.sqrt(5)) * part)
    centers = jet(width - 2 * radius, spacing, rate / count, velocity, start, stop)
    time, place, speed = (np.repeat(each, count, axis=0) for each in centers)
    return time, place + np.tile(drop.T, (len(centers[0]), 1)), speed
