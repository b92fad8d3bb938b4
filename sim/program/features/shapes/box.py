"""Boxes: rectangles."""

from typing import Literal

import numpy as np
from pydantic import model_validator

from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.program.words import (
    ti,
    vec2,
    vec3,
)
from mpmworlds.sim.scene.fields import Vec2, about
from mpmworlds.sim.scene.outlines import Outline, rectangle


class Box(Turned):
    """Rectangle."""

    type: Literal["box"] = about("neutral", "kind of shape")
    size: Vec2 = about("neutral", "width and height", "m", kind="length")

    @model_validator(mode="after")
    def _sides(self) -> "Box":
        if min(self.size) <= 0.0 or max(self.size) > 1.0:
            raise ValueError(
                f"shape.size = {list(self.size)}, both must be > 0 and <= 1"
            )
        return self

    def numbers(self) -> tuple[float, ...]:
        """Width and height."""
        return self.size

    def local_outline(self) -> Outline:
        """One rectangle."""
        return [rectangle(self.size)]


def box(x, y, width, height):
    """Signed distance from a box around the origin."""
    x, y = abs(x) - width / 2, abs(y) - height / 2
    outside = np.sqrt(np.maximum(x, 0) ** 2 + np.maximum(y, 0) ** 2)
    return outside + np.minimum(np.maximum(x, y), 0)


def box_line(width, height):
    """Corners of a box, the first once more at the end."""
    x, y = width / 2, height / 2
    return [(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)]


@ti.func
def sd_box(p, width, height):
    """Outward normal and signed distance [m] of a box around the origin."""
    q, side = abs(p) - 0.5 * vec2(width, height), ti.select(p < 0.0, -1.0, 1.0)
    n = ti.select(q.x > q.y, vec2(side.x, 0.0), vec2(0.0, side.y))
    out = ti.max(q, 0.0)
    far = out.norm()
    n = ti.select(far > 0.0, side * out / ti.max(far, 1e-9), n)
    return vec3(n, far + ti.min(q.max(), 0.0))
