"""Rings and bowls."""

import math
from typing import Literal

import numpy as np
from pydantic import model_validator

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.program.words import (
    ti,
    vec2,
    vec3,
)
from mpmworlds.sim.scene.fields import about
from mpmworlds.sim.scene.outlines import Corners, Outline, arc


class Ring(Turned):
    """Ring with a gap around +y and round ends; closed if `opening_deg` is 0.

    `radius` is that of its center line, on which the opening is measured, so that a
    bowl has an opening of 180 degrees and ends that rise half a thickness above.
    """

    type: Literal["ring"] = about("neutral", "kind of shape")
    radius: float = about(
        "neutral", "radius of the center line", "m", gt=0.0, le=0.5, kind="length"
    )
    thickness: float = about(
        "neutral", "thickness of the wall", "m", gt=0.0, le=0.5, kind="thickness"
    )
    opening_deg: float = about(
        "neutral",
        "angle of the gap around +y",
        "deg",
        default=0.0,
        ge=0.0,
        le=330.0,
        kind="span",
    )

    @model_validator(mode="after")
    def _hole(self) -> "Ring":
        if self.thickness >= 2.0 * self.radius:
            raise ValueError(
                f"shape.thickness = {self.thickness:g}, must be < 2 x radius = "
                f"{2.0 * self.radius:g}, or there is no hole; use a circle"
            )
        half = 0.5 * math.radians(min(self.opening_deg, 180.0))
        if 0.0 < 2.0 * self.radius * math.sin(half) <= self.thickness:
            raise ValueError(
                f"shape.opening_deg = {self.opening_deg:g}, must leave a gap between "
                "the round ends; widen it, or use 0 for a closed ring"
            )
        return self

    def numbers(self) -> tuple[float, ...]:
        """Radius of the center line, thickness, and angle of the gap [deg]."""
        return self.radius, self.thickness, self.opening_deg

    def roundness(self) -> float:
        """Half of the thickness."""
        return 0.5 * self.thickness

    def local_outline(self) -> Outline:
        """Two halves if it is closed, or one arc."""
        if self.opening_deg == 0.0:
            return [self._wall(a, a + np.pi, capped=False) for a in (0.0, np.pi)]
        half = 0.5 * math.radians(self.opening_deg)
        return [self._wall(0.5 * np.pi + half, 2.5 * np.pi - half, capped=True)]

    def _wall(self, start: float, stop: float, capped: bool) -> Corners:
        """The wall from one angle to another [rad], with or without round ends."""
        r = 0.5 * self.thickness
        outer, inner = (arc(self.radius + s, start, stop) for s in (r, -r))
        parts = [outer, inner[::-1]]
        if capped:
            caps = [
                self.radius * np.array([math.cos(end), math.sin(end)])
                + arc(r, end + turn, end + turn + np.pi)[1:-1]
                for end, turn in ((stop, 0.0), (start, np.pi))
            ]
            parts = [outer, caps[0], inner[::-1], caps[1]]
        return np.concatenate(parts)


def ring(x, y, radius, thickness, opening):
    """Signed distance from a ring that is open by some degrees around +y."""
    cos, sin = unit(np.radians(opening / 2))
    end_x, end_y = radius * sin, radius * cos
    wall = abs(np.sqrt(x**2 + y**2) - radius)
    cap = np.sqrt((abs(x) - end_x) ** 2 + (y - end_y) ** 2)
    in_gap = y * end_x > abs(x) * end_y
    return np.where(in_gap, cap, wall) - thickness / 2


def ring_line(radius, thickness, opening):
    """Points on the center line of a ring from one end of its gap to the other."""
    angles = np.radians(np.linspace(90 + opening / 2, 450 - opening / 2, 241))
    return [(radius * c, radius * s) for c, s in map(unit, angles)]


@ti.func
def sd_ring(p, radius, thickness, opening: ti.template()):
    """Outward normal and signed distance [m] of a ring, open by degrees around +y."""
    cos, sin = ti.static(unit(np.radians(opening / 2)))
    end = radius * vec2(sin, cos)
    arm, far = p, p.norm() - radius
    if p.y * end.x > abs(p.x) * end.y:  # in the gap
        arm = p - vec2(ti.select(p.x < 0.0, -end.x, end.x), end.y)
        far = arm.norm()
    n = ti.select(far < 0.0, -1.0, 1.0) * arm / ti.max(arm.norm(), 1e-9)
    return vec3(n, abs(far) - 0.5 * thickness)
