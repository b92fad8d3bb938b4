"""What shapes have in common.

The module of a shape has two halves of the same signed distance: a NumPy function of
its name, over points of arrays, for what is seeded or never moves, and `sd_` and its
name, a Taichi function that gives the outward normal, too, for what moves. A third
function, its name and `_line`, is for rigid bodies: a polyline such that the shape is
what lies within `roundness` of it, or what it encloses. All take the shape's `numbers`.
"""

import math
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mpmworlds.sim.scene.fields import Part, Vec2, about
from mpmworlds.sim.scene.outlines import Outline

Floats = npt.NDArray[np.float64]
RASTER = 400  # points across a shape, where its moments are summed


class Shape(Part):
    """What every shape has: where it is."""

    if TYPE_CHECKING:
        type: str

    center: Vec2 = about("position", "center of the shape", "m", kind="position")

    def angle(self) -> float:
        """Turn of the shape from its own frame [rad]."""
        return math.radians(getattr(self, "angle_deg", 0.0))

    def numbers(self) -> tuple[Any, ...]:
        """Numbers that the functions of its module take."""
        raise TypeError(f"{type(self).__name__} has no numbers")

    def roundness(self) -> float:
        """Distance of the surface from the `_line` of the shape [m]."""
        return 0.0

    def reach(self) -> float:
        """Radius around the center that the shape stays within [m]."""
        corners = np.concatenate(self.local_outline())
        return float(np.sqrt((corners**2).sum(axis=1)).max())

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

    def distance(self, x: Floats, y: Floats) -> Floats:
        """Signed distance [m] of points (x, y) in the frame of the shape."""
        module = sys.modules[type(self).__module__]
        name = getattr(self, "type")  # noqa: B009 - every member has one
        found: Floats = getattr(module, name)(x, y, *self.numbers())
        return found

    def moments(self) -> tuple[float, float, float, float]:
        """Area [m^2], center of area (x, y) [m] and polar second moment [m^4].

        All about the center of the shape, summed over points each of which counts by
        the part of its square that is inside.
        """
        most = 1.01 * self.reach()
        step = 2.0 * most / RASTER
        points = step * (np.arange(RASTER, dtype=np.float64) + 0.5) - most
        x, y = points[:, None], points[None, :]
        part = (0.5 - self.distance(x, y) / step).clip(0.0, 1.0) * step**2
        area = float(part.sum())
        center = float((part * x).sum()) / area, float((part * y).sum()) / area
        return area, *center, float((part * (x * x + y * y)).sum())


class Turned(Shape):
    """A shape that has an orientation."""

    angle_deg: float = about(
        "position",
        "counter-clockwise turn",
        "deg",
        default=0.0,
        ge=-360.0,
        le=360.0,
        kind="angle",
    )
