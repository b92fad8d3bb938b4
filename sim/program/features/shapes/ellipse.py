"""Ellipses."""

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
from mpmworlds.sim.scene.fields import Vec2, about
from mpmworlds.sim.scene.outlines import Outline, arc

SLENDER = 5.0  # largest ratio of the axes of an ellipse


class Ellipse(Turned):
    """Ellipse."""

    type: Literal["ellipse"] = about("neutral", "kind of shape")
    semi_axes: Vec2 = about("neutral", "half of width and height", "m", kind="length")

    @model_validator(mode="after")
    def _axes(self) -> "Ellipse":
        if min(self.semi_axes) <= 0.0 or max(self.semi_axes) > 0.5:
            raise ValueError(
                f"shape.semi_axes = {list(self.semi_axes)}, both must be > 0 and <= 0.5"
            )
        if max(self.semi_axes) > SLENDER * min(self.semi_axes):
            raise ValueError(
                f"shape.semi_axes = {list(self.semi_axes)}, one must be <= "
                f"{SLENDER:g} x the other; use a capsule for what is more slender"
            )
        return self

    def numbers(self) -> tuple[float, ...]:
        """Half of width and height."""
        return self.semi_axes

    def local_outline(self) -> Outline:
        """One polygon of the area of the ellipse."""
        return [arc(1.0, 0.0, 2 * np.pi)[:-1] * self.semi_axes]


def ellipse(x, y, a, b):
    """Signed distance from an ellipse with semi-axes a and b.

    The nearest point is (a c, b s), sought by fitting circles of curvature there.
    """
    x, y, c, s = abs(x), abs(y), 0.7, 0.7
    bend = a * a - b * b
    for _ in range(4):
        mx, my = bend / a * c * c * c, -bend / b * s * s * s
        far = np.sqrt((a * c - mx) ** 2 + (b * s - my) ** 2)
        far = far / np.maximum(np.sqrt((x - mx) ** 2 + (y - my) ** 2), 1e-9)
        c = np.maximum((mx + (x - mx) * far) / a, 1e-9)
        s = np.maximum((my + (y - my) * far) / b, 1e-9)
        size = np.sqrt(c**2 + s**2)
        c, s = c / size, s / size
    n = c / a, s / b
    return (n[0] * (x - a * c) + n[1] * (y - b * s)) / np.sqrt(n[0] ** 2 + n[1] ** 2)


def ellipse_line(a, b):
    """Points on an ellipse, the first once more at the end."""
    units = [unit(angle) for angle in np.linspace(0, 2 * np.pi, 241)]
    return [(a * c, b * s) for c, s in units]


@ti.func
def sd_ellipse(p, a, b):
    """Outward normal and signed distance [m] of an ellipse with semi-axes a and b.

    The nearest point is (a, b) t, sought by fitting circles of curvature at t.
    """
    axes, z, t = vec2(a, b), abs(p), vec2(0.7)
    bend = vec2(a * a - b * b, b * b - a * a) / axes
    for _ in range(4):
        middle = bend * t * t * t  # of the circle of curvature
        arm, away = axes * t - middle, z - middle
        far = ti.max(away.norm(), 1e-9)
        t = ti.max((middle + away * arm.norm() / far) / axes, 1e-9).normalized()
    n = (t / axes).normalized()
    return vec3(ti.select(p < 0.0, -n, n), n.dot(z - axes * t))
