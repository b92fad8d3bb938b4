"""Circles: discs."""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.shape import Shape
from mpmworlds.sim.program.words import (
    ti,
    vec3,
)
from mpmworlds.sim.scene.fields import about
from mpmworlds.sim.scene.outlines import Outline, arc


class Circle(Shape):
    """Disc."""

    type: Literal["circle"] = about("neutral", "kind of shape")
    radius: float = about("neutral", "radius", "m", gt=0.0, le=0.5, kind="length")

    def numbers(self) -> tuple[float, ...]:
        """The radius."""
        return (self.radius,)

    def roundness(self) -> float:
        """The radius."""
        return self.radius

    def local_outline(self) -> Outline:
        """One regular polygon of the area of the disc."""
        return [arc(self.radius, 0.0, 2 * np.pi)[:-1]]


def circle(x, y, radius):
    """Signed distance from a disc around the origin."""
    return np.sqrt(x**2 + y**2) - radius


def circle_line(radius):
    """The center of a disc."""
    return [(0.0, 0.0)]


@ti.func
def sd_circle(p, radius):
    """Outward normal and signed distance [m] of a disc around the origin."""
    r = p.norm()
    return vec3(p / ti.max(r, 1e-9), r - radius)
