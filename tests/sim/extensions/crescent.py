"""Crescents: a disc without another one [Quilez, sdMoon]."""

import math
from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.program.words import (
    ti,
    vec2,
    vec3,
)
from mpmworlds.sim.scene.fields import about
from mpmworlds.sim.scene.outlines import Outline, arc


class Crescent(Turned):
    """A disc without the part of it in a disc of the same size, further along x."""

    type: Literal["crescent"] = about("neutral", "kind of shape")
    radius: float = about(
        "neutral", "radius of both discs", "m", gt=0.0, le=0.5, kind="length"
    )
    offset: float = about(
        "neutral", "distance of their centers", "m", gt=0.0, le=0.5, kind="length"
    )

    def numbers(self) -> tuple[float, ...]:
        """Radius and offset."""
        return self.radius, self.offset

    def local_outline(self) -> Outline:
        """One polygon along both arcs."""
        tip = math.acos(0.5 * self.offset / self.radius)
        outer = arc(self.radius, tip, 2 * np.pi - tip)
        inner = arc(self.radius, np.pi - tip, np.pi + tip) + (self.offset, 0.0)
        return [np.concatenate([outer, inner[::-1][1:-1]])]


def crescent(x, y, radius, offset):
    """Signed distance from a disc without another, which is offset along x."""
    tip = np.sqrt(radius**2 - offset**2 / 4)
    outer = np.sqrt(x**2 + y**2) - radius
    inner = radius - np.sqrt((x - offset) ** 2 + y**2)
    horn = np.sqrt((x - offset / 2) ** 2 + (abs(y) - tip) ** 2)
    beyond = (x - offset / 2) * tip > offset / 2 * abs(abs(y) - tip)
    return np.where(beyond & (outer > 0), horn, np.maximum(outer, inner))


@ti.func
def sd_crescent(p, radius, offset):
    """Outward normal and signed distance [m] of a disc without another along x."""
    q = p - vec2(offset, 0.0)
    outer, inner = p.norm() - radius, radius - q.norm()
    n = p / ti.max(p.norm(), 1e-9)
    if inner > outer:
        n = -q / ti.max(q.norm(), 1e-9)
    return vec3(n, ti.max(outer, inner))
