"""Shapes of objects: their parameters, outlines, and reach.

An outline is a list of polygons, each (n, 2) [m] in the frame of the shape, that
together cover it. Checks and layouts use outlines; the simulation uses the signed
distances of `physics.shapes`. A test holds the two together.

`MEASURES` are the expressions of a program for the up to three numbers m that its
distance takes, and `REACH` the one for the radius around its center; both read the
parameters as `shape["name"]`. `DISTANCE` gives the signed distance at `p` from m.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from mpmworlds.sim.fields import Part, Points, Vec2, about, polygon_area

Outline = list[npt.NDArray[np.float64]]


class Placed(Part):
    """What every shape has: where it is."""

    MEASURES: ClassVar[str]
    REACH: ClassVar[str]
    DISTANCE: ClassVar[str]

    center: Vec2 = about("position", "center of the shape", "m")

    def angle(self) -> float:
        """Turn of the shape from its own frame [rad]."""
        return math.radians(getattr(self, "angle_deg", 0.0))

    def local_outline(self) -> Outline:
        """Polygons that cover the shape, in its own frame [m]."""
        raise TypeError(f"{type(self).__name__} has no outline")

    def outline(
        self, shift: tuple[float, float] = (0, 0), turn: float = 0.0
    ) -> Outline:
        """Polygons that cover the shape in the domain, displaced by shift and turn."""
        angle = self.angle() + turn
        cos, sin = math.cos(angle), math.sin(angle)
        rotation = np.array([[cos, sin], [-sin, cos]])
        offset = np.add(self.center, shift)
        return [polygon @ rotation + offset for polygon in self.local_outline()]


class Turned(Placed):
    """A shape that has an orientation."""

    angle_deg: float = about(
        "position", "counter-clockwise turn", "deg", default=0.0, ge=-360.0, le=360.0
    )


class Box(Turned):
    """Rectangle."""

    MEASURES = '*shape["size"], 0'
    REACH = 'np.hypot(*shape["size"]) / 2'
    DISTANCE = "sd_box(p, m.xy)"

    type: Literal["box"] = about("neutral", "kind of shape")
    size: Vec2 = about("neutral", "width and height", "m")

    @model_validator(mode="after")
    def _sides(self) -> "Box":
        if min(self.size) <= 0.0 or max(self.size) > 1.0:
            raise ValueError(
                f"shape.size = {list(self.size)}, both must be > 0 and <= 1"
            )
        return self

    def local_outline(self) -> Outline:
        """One rectangle."""
        w, h = 0.5 * self.size[0], 0.5 * self.size[1]
        return [np.array([[-w, -h], [w, -h], [w, h], [-w, h]])]


class Circle(Placed):
    """Disc."""

    MEASURES = 'shape["radius"], 0, 0'
    REACH = 'shape["radius"]'
    DISTANCE = "sd_circle(p, m.x)"

    type: Literal["circle"] = about("neutral", "kind of shape")
    radius: float = about("neutral", "radius", "m", gt=0.0, le=0.5)

    def local_outline(self) -> Outline:
        """One regular 96-gon of the area of the disc."""
        n = 96
        angle = 2 * np.pi * np.arange(n) / n
        radius = self.radius * math.sqrt(2 * np.pi / n / math.sin(2 * np.pi / n))
        return [radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)]


class Polygon(Turned):
    """Simple polygon, convex or not; vertices are relative to the center."""

    MEASURES = 'len(shape["vertices"]), 0, 0'
    REACH = 'max(np.hypot(*vertex) for vertex in shape["vertices"])'
    DISTANCE = "sd_polygon(p, corners, k, int(m.x))"

    type: Literal["polygon"] = about("neutral", "kind of shape")
    vertices: Points = about("neutral", "corners in order, from the center", "m")

    @model_validator(mode="after")
    def _simple(self) -> "Polygon":
        if any(abs(x) > 1.0 for vertex in self.vertices for x in vertex):
            raise ValueError("shape.vertices must lie within 1 m of the center")
        if _crosses_itself(np.array(self.vertices)):
            raise ValueError("shape.vertices cross; list the corners in order")
        if polygon_area(self.vertices) < 1e-5:
            raise ValueError("shape.vertices enclose no area; move a vertex")
        return self

    def local_outline(self) -> Outline:
        """The polygon itself."""
        return [np.array(self.vertices)]


class FanBlades(Turned):
    """Straight, round-ended blades around a hub."""

    MEASURES = 'shape["blade_count"], shape["blade_length"], shape["thickness"]'
    REACH = 'shape["blade_length"] + shape["thickness"] / 2'
    DISTANCE = "sd_fan(p, m.x, m.y, m.z)"

    type: Literal["fan_blades"] = about("neutral", "kind of shape")
    blade_count: int = about("neutral", "number of blades", ge=2, le=12)
    blade_length: float = about("neutral", "hub to blade tip axis", "m", gt=0.0, le=0.5)
    thickness: float = about("neutral", "thickness of a blade", "m", gt=0.0, le=0.2)

    def local_outline(self) -> Outline:
        """One capsule for each blade."""
        r = 0.5 * self.thickness
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13)
        tip = r * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        blade = np.concatenate([tip + [self.blade_length, 0.0], -tip])
        turns = 2 * np.pi * np.arange(self.blade_count) / self.blade_count
        return [
            blade @ np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]])
            for t in turns
        ]


Shape = Annotated[Box | Circle | Polygon | FanBlades, Field(discriminator="type")]
SHAPES: dict[str, type[Placed]] = {
    "box": Box,
    "circle": Circle,
    "fan_blades": FanBlades,
    "polygon": Polygon,
}


def _crosses_itself(p: npt.NDArray[np.float64]) -> bool:
    """Whether two edges of a closed polygon (n, 2) that are not neighbours meet."""

    def side(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64], i: int) -> float:
        ab, ac = b - a, p[i % len(p)] - a
        return float(np.sign(ab[0] * ac[1] - ab[1] * ac[0]))

    n = len(p)
    for i in range(n):
        for j in range(i + 2, n - (i == 0)):
            a, b, c, d = p[i], p[(i + 1) % n], p[j], p[(j + 1) % n]
            if (
                side(a, b, j) != side(a, b, j + 1)
                and side(c, d, i) != side(c, d, i + 1)
            ):  # fmt: skip
                return True
    return False
