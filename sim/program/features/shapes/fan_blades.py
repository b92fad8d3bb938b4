"""Fans: straight blades around a hub."""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.program.words import (
    clamp,
    ti,
    vec2,
    vec3,
)
from mpmworlds.sim.scene.fields import about
from mpmworlds.sim.scene.outlines import Outline, stadium


class FanBlades(Turned):
    """Straight, round-ended blades around a hub."""

    angle_deg: float = about(
        "position",
        "counter-clockwise turn of the first blade from +x",
        "deg",
        default=0.0,
        ge=-360.0,
        le=360.0,
        kind="heading",
    )
    type: Literal["fan_blades"] = about("neutral", "kind of shape")
    blade_count: int = about("neutral", "number of blades", ge=2, le=12, kind="count")
    blade_length: float = about(
        "neutral", "hub to blade tip axis", "m", gt=0.0, le=0.5, kind="length"
    )
    thickness: float = about(
        "neutral", "thickness of a blade", "m", gt=0.0, le=0.2, kind="thickness"
    )

    def numbers(self) -> tuple[float, ...]:
        """Number, length and thickness of the blades."""
        return self.blade_count, self.blade_length, self.thickness

    def roundness(self) -> float:
        """Half of the thickness."""
        return 0.5 * self.thickness

    def local_outline(self) -> Outline:
        """One capsule for each blade."""
        blade = stadium(0.0, self.blade_length, 0.5 * self.thickness)
        turns = 2 * np.pi * np.arange(self.blade_count) / self.blade_count
        return [
            blade @ np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]])
            for t in turns
        ]


def fan_blades(x, y, count, length, thickness):
    """Signed distance from blades around the origin, the first along x."""
    nearest = np.inf
    for i in range(count):
        c, s = unit(2 * np.pi * i / count)
        along = np.clip(c * x + s * y, 0, length)
        nearest = np.minimum(nearest, (x - along * c) ** 2 + (y - along * s) ** 2)
    return np.sqrt(nearest) - thickness / 2


def fan_blades_line(count, length, thickness):
    """Axes of blades, to and fro."""
    line = [(0.0, 0.0)]
    for i in range(count):
        c, s = unit(2 * np.pi * i / count)
        line += [(length * c, length * s), (0.0, 0.0)]
    return line


@ti.func
def sd_fan_blades(p, count: ti.template(), length, thickness):
    """Outward normal and signed distance [m] of blades, the first along x."""
    blade = vec2(1.0, 0.0)
    for i in ti.static(range(1, count)):
        cos, sin = ti.static(unit(2 * np.pi * i / count))
        other = vec2(cos, sin)
        if p.dot(other) > p.dot(blade):
            blade = other
    arm = p - clamp(p.dot(blade), 0.0, length) * blade
    r = arm.norm()
    return vec3(arm / ti.max(r, 1e-9), r - 0.5 * thickness)
