"""Belts."""

from typing import Literal

from mpmworlds.sim.program.features.motion import REST, Motion, Pose
from mpmworlds.sim.scene.fields import about


class Conveyor(Motion):
    """Belt around the shape, which stays where it is: clockwise if positive."""

    type: Literal["conveyor"] = about("neutral", "kind of motion")
    surface_speed: float = about(
        "neutral", "speed of the belt", "m/s", ge=-20, le=20, kind="speed"
    )

    def fastest(self, reach: float) -> float:
        """Speed of the belt."""
        return abs(self.surface_speed)

    def poses(self) -> list[Pose]:
        """Rest."""
        return [REST]
