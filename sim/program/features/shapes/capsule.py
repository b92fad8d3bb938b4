"""Capsules: straight bars with round ends."""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.program.words import (
    clamp,
    ti,
    vec2,
    vec3,
)
from mpmworlds.sim.scene.fields import about
from mpmworlds.sim.scene.outlines import Outline, stadium


class Capsule(Turned):
    """Straight bar with round ends, along x."""

    type: Literal["capsule"] = about("neutral", "kind of shape")
    length: float = about(
        "neutral", "between ends of the axis", "m", gt=0.0, le=1.0, kind="length"
    )
    radius: float = about(
        "neutral", "half of the width", "m", gt=0.0, le=0.5, kind="length"
    )

    def numbers(self) -> tuple[float, ...]:
        """Length and radius."""
        return self.length, self.radius

    def roundness(self) -> float:
        """The radius."""
        return self.radius

    def local_outline(self) -> Outline:
        """One stadium."""
        return [stadium(-0.5 * self.length, 0.5 * self.length, self.radius)]


def capsule(x, y, length, radius):
    """Signed distance from a bar with round ends along x."""
    x = x - np.clip(x, -length / 2, length / 2)
    return np.sqrt(x**2 + y**2) - radius


def capsule_line(length, radius):
    """Ends of the axis of a bar."""
    return [(-length / 2, 0.0), (length / 2, 0.0)]


@ti.func
def sd_capsule(p, length, radius):
    """Outward normal and signed distance [m] of a bar with round ends along x."""
    q = vec2(p.x - clamp(p.x, -0.5 * length, 0.5 * length), p.y)
    r = q.norm()
    n = ti.select(r > 0.0, q / ti.max(r, 1e-9), vec2(0.0, 1.0))
    return vec3(n, r - radius)
