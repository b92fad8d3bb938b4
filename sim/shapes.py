"""Shapes of objects: their parameters, outlines, and reach.

Checks and layouts use outlines; the simulation uses the signed distances of
`physics.shapes`. A test holds the two together.

`MEASURES` are the expressions of a program for the up to three numbers m that its
distance takes, and `REACH` the one for the radius around its center; both read the
parameters as `shape["name"]`. `DISTANCE` gives the signed distance at `p` from m.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from mpmworlds.sim.scene.fields import Part, Points, Vec2, about, polygon_area
from mpmworlds.sim.scene.outlines import (
    Corners,
    Outline,
    arc,
    crosses_itself,
    rectangle,
    stadium,
)

SLENDER = 5.0  # largest ratio of the axes of an ellipse


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
        return [rectangle(self.size)]


class RoundedBox(Turned):
    """Rectangle with round corners."""

    MEASURES = '*shape["size"], shape["corner_radius"]'
    REACH = 'np.hypot(*shape["size"]) / 2'
    DISTANCE = "sd_rounded_box(p, m.xy, m.z)"

    type: Literal["rounded_box"] = about("neutral", "kind of shape")
    size: Vec2 = about("neutral", "width and height", "m")
    corner_radius: float = about("neutral", "radius of the corners", "m", gt=0.0)

    @model_validator(mode="after")
    def _sides(self) -> "RoundedBox":
        if max(self.size) > 1.0 or 2.0 * self.corner_radius > min(self.size):
            raise ValueError(
                f"shape.size = {list(self.size)}, both must be <= 1 and >= "
                f"2 x corner_radius = {2.0 * self.corner_radius:g}"
            )
        return self

    def local_outline(self) -> Outline:
        """One rectangle with an arc at each corner."""
        r, quarter = self.corner_radius, 0.5 * np.pi
        middles = rectangle((self.size[0] - 2 * r, self.size[1] - 2 * r))
        arcs = [arc(r, (i - 2) * quarter, (i - 1) * quarter) for i in range(4)]
        return [np.concatenate([m + a for m, a in zip(middles, arcs, strict=True)])]


class Circle(Placed):
    """Disc."""

    MEASURES = 'shape["radius"], 0, 0'
    REACH = 'shape["radius"]'
    DISTANCE = "sd_circle(p, m.x)"

    type: Literal["circle"] = about("neutral", "kind of shape")
    radius: float = about("neutral", "radius", "m", gt=0.0, le=0.5)

    def local_outline(self) -> Outline:
        """One regular polygon of the area of the disc."""
        return [arc(self.radius, 0.0, 2 * np.pi)[:-1]]


class Ellipse(Turned):
    """Ellipse."""

    MEASURES = '*shape["semi_axes"], 0'
    REACH = 'max(shape["semi_axes"])'
    DISTANCE = "sd_ellipse(p, m.xy)"

    type: Literal["ellipse"] = about("neutral", "kind of shape")
    semi_axes: Vec2 = about("neutral", "half of width and height", "m")

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

    def local_outline(self) -> Outline:
        """One polygon of the area of the ellipse."""
        return [arc(1.0, 0.0, 2 * np.pi)[:-1] * self.semi_axes]


class Capsule(Turned):
    """Straight bar with round ends, along x."""

    MEASURES = 'shape["length"], shape["radius"], 0'
    REACH = 'shape["length"] / 2 + shape["radius"]'
    DISTANCE = "sd_capsule(p, m.x, m.y)"

    type: Literal["capsule"] = about("neutral", "kind of shape")
    length: float = about("neutral", "between ends of the axis", "m", gt=0.0, le=1.0)
    radius: float = about("neutral", "half of the width", "m", gt=0.0, le=0.5)

    def local_outline(self) -> Outline:
        """One stadium."""
        return [stadium(-0.5 * self.length, 0.5 * self.length, self.radius)]


class Ring(Turned):
    """Ring with a gap around +y and round ends; closed if `opening_deg` is 0.

    `radius` is that of its center line, on which the opening is measured, so that a
    bowl has an opening of 180 degrees and ends that rise half a thickness above.
    """

    MEASURES = 'shape["radius"], shape["thickness"], shape["opening_deg"]'
    REACH = 'shape["radius"] + shape["thickness"] / 2'
    DISTANCE = "sd_ring(p, m.x, m.y, m.z)"

    type: Literal["ring"] = about("neutral", "kind of shape")
    radius: float = about("neutral", "radius of the center line", "m", gt=0.0, le=0.5)
    thickness: float = about("neutral", "thickness of the wall", "m", gt=0.0, le=0.5)
    opening_deg: float = about(
        "neutral", "angle of the gap around +y", "deg", default=0.0, ge=0.0, le=330.0
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
        if crosses_itself(np.array(self.vertices)):
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
        blade = stadium(0.0, self.blade_length, 0.5 * self.thickness)
        turns = 2 * np.pi * np.arange(self.blade_count) / self.blade_count
        return [
            blade @ np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]])
            for t in turns
        ]


Shape = Annotated[
    Box | Capsule | Circle | Ellipse | FanBlades | Polygon | Ring | RoundedBox,
    Field(discriminator="type"),
]
SHAPES: dict[str, type[Placed]] = {
    "box": Box,
    "capsule": Capsule,
    "circle": Circle,
    "ellipse": Ellipse,
    "fan_blades": FanBlades,
    "polygon": Polygon,
    "ring": Ring,
    "rounded_box": RoundedBox,
}
