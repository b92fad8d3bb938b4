"""Boxes with round corners."""

from typing import Literal

import numpy as np
from pydantic import model_validator

from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.program.features.shapes.box import box, box_line, sd_box
from mpmworlds.sim.program.words import (
    ti,
    vec3,
)
from mpmworlds.sim.scene.fields import Vec2, about
from mpmworlds.sim.scene.outlines import Outline, arc, rectangle


class RoundedBox(Turned):
    """Rectangle with round corners."""

    type: Literal["rounded_box"] = about("neutral", "kind of shape")
    size: Vec2 = about("neutral", "width and height", "m", kind="length")
    corner_radius: float = about(
        "neutral", "radius of the corners", "m", gt=0.0, kind="length"
    )

    @model_validator(mode="after")
    def _sides(self) -> "RoundedBox":
        if max(self.size) > 1.0 or 2.0 * self.corner_radius > min(self.size):
            raise ValueError(
                f"shape.size = {list(self.size)}, both must be <= 1 and >= "
                f"2 x corner_radius = {2.0 * self.corner_radius:g}"
            )
        return self

    def numbers(self) -> tuple[float, ...]:
        """Width, height, and radius of the corners."""
        return *self.size, self.corner_radius

    def roundness(self) -> float:
        """Radius of the corners."""
        return self.corner_radius

    def local_outline(self) -> Outline:
        """One rectangle with an arc at each corner."""
        r, quarter = self.corner_radius, 0.5 * np.pi
        middles = rectangle((self.size[0] - 2 * r, self.size[1] - 2 * r))
        arcs = [arc(r, (i - 2) * quarter, (i - 1) * quarter) for i in range(4)]
        return [np.concatenate([m + a for m, a in zip(middles, arcs, strict=True)])]


def rounded_box(x, y, width, height, radius):
    """Signed distance from a box with round corners around the origin."""
    return box(x, y, width - 2 * radius, height - 2 * radius) - radius


def rounded_box_line(width, height, radius):
    """Centers of the round corners of a box, the first once more at the end."""
    return box_line(width - 2 * radius, height - 2 * radius)


@ti.func
def sd_rounded_box(p, width, height, radius):
    """Outward normal and signed distance [m] of a box with round corners."""
    s = sd_box(p, width - 2.0 * radius, height - 2.0 * radius)
    return s - vec3(0.0, 0.0, radius)
