"""Polygons: simple ones, convex or not."""

from typing import Literal

import numpy as np
from pydantic import model_validator

from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.program.words import (
    clamp,
    ti,
    vec2,
    vec3,
)
from mpmworlds.sim.scene.fields import Points, about, polygon_area
from mpmworlds.sim.scene.outlines import Outline, crosses_itself


class Polygon(Turned):
    """Simple polygon, convex or not; vertices are relative to the center."""

    type: Literal["polygon"] = about("neutral", "kind of shape")
    vertices: Points = about(
        "neutral", "corners in order, from the center", "m", kind="offset"
    )

    @model_validator(mode="after")
    def _simple(self) -> "Polygon":
        if any(abs(x) > 1.0 for vertex in self.vertices for x in vertex):
            raise ValueError("shape.vertices must lie within 1 m of the center")
        if crosses_itself(np.array(self.vertices)):
            raise ValueError("shape.vertices cross; list the corners in order")
        if polygon_area(self.vertices) < 1e-5:
            raise ValueError("shape.vertices enclose no area; move a vertex")
        return self

    def numbers(self) -> tuple[list[tuple[float, float]]]:
        """The corners."""
        return (list(self.vertices),)

    def local_outline(self) -> Outline:
        """The polygon itself."""
        return [np.array(self.vertices)]


def polygon(x, y, corners):
    """Signed distance from a simple polygon."""
    nearest, inside = np.inf, False
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        ex, ey, px, py = bx - ax, by - ay, x - ax, y - ay
        along = np.clip((px * ex + py * ey) / (ex * ex + ey * ey), 0, 1)
        away = (px - along * ex) ** 2 + (py - along * ey) ** 2
        nearest = np.minimum(nearest, away)
        crossed = (px * ey < py * ex) == (ey > 0)  # to the right, if at its height
        inside = inside ^ (((ay > y) != (by > y)) & crossed)
    return np.where(inside, -1, 1) * np.sqrt(nearest)


def polygon_line(corners):
    """Corners of a polygon, the first once more at the end."""
    return [*corners, corners[0]]


@ti.func
def sd_polygon(p, corners: ti.template()):
    """Outward normal and signed distance [m] of a simple polygon."""
    nearest, side, c = vec2(1e9, 0.0), 1.0, ti.Matrix(corners)
    start = vec2(c[c.n - 1, 0], c[c.n - 1, 1])
    for i in range(c.n):
        end = vec2(c[i, 0], c[i, 1])
        edge, arm = end - start, p - start
        away = arm - clamp(arm.dot(edge) / edge.dot(edge), 0.0, 1.0) * edge
        if away.dot(away) < nearest.dot(nearest):
            nearest = away
        if (start.y > p.y) != (end.y > p.y):
            if (arm.x * edge.y < arm.y * edge.x) == (edge.y > 0.0):
                side = -side
        start = end
    d = nearest.norm()
    return vec3(side * nearest / ti.max(d, 1e-9), side * d)
