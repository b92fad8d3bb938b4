"""Prescribed motions of colliders.

`MOVE` is the expression of a program that gives the displacement of a motion and its
rate at time `t`; it takes the parameters as the mapping `motion`. Checks ask a motion
how fast it is and which poses it sweeps.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from mpmworlds.sim.scene.fields import Part, Vec2, about

Pose = tuple[tuple[float, float], float]  # displacement [m] and turn [rad]
REST: Pose = ((0.0, 0.0), 0.0)
POSES = 25  # looked at along the way of a motion that turns


class Timed(Part):
    """What lasts from one time to another."""

    start: float = about("neutral", "when it starts", "s", default=0.0, ge=0, le=100)
    stop: float = about("neutral", "when it stops", "s", gt=0.0, le=100.0)

    @field_validator("stop")
    @classmethod
    def _order(cls, stop: float, info: ValidationInfo) -> float:
        start = info.data.get("start", 0.0)
        if stop <= start:
            raise ValueError(f"must be > start = {start}")
        return stop


class Motion(Timed):
    """What every motion has; it lasts forever unless it is told to stop."""

    MOVE: ClassVar[str]

    stop: float = about(
        "neutral", "when it stops", "s", default=100.0, gt=0.0, le=100.0
    )

    def fastest(self, reach: float) -> float:
        """Largest speed [m/s] of a point within a reach [m] of the center."""
        raise TypeError(f"{type(self).__name__} has no speed")

    def poses(self) -> list[Pose]:
        """Displacements that together show how far the motion leads."""
        raise TypeError(f"{type(self).__name__} has no poses")


class Rotate(Motion):
    """Constant spin about the center of the shape."""

    MOVE = "rotate(t, motion)"

    type: Literal["rotate"] = about("neutral", "kind of motion")
    angular_velocity: float = about("neutral", "spin", "rad/s", ge=-100.0, le=100.0)

    def fastest(self, reach: float) -> float:
        """Speed of the tip."""
        return abs(self.angular_velocity) * reach

    def poses(self) -> list[Pose]:
        """Turns up to a full one."""
        turn = self.angular_velocity * (self.stop - self.start)
        turns = np.linspace(0.0, max(min(turn, 2 * np.pi), -2 * np.pi), POSES)
        return [((0.0, 0.0), angle) for angle in turns.tolist()]


class Translate(Motion):
    """Constant velocity between two times, at rest before and after."""

    MOVE = "translate(t, motion)"

    type: Literal["translate"] = about("neutral", "kind of motion")
    velocity: Vec2 = about("position", "velocity while it moves", "m/s")

    def fastest(self, reach: float) -> float:
        """The speed."""
        return math.hypot(*self.velocity)

    def poses(self) -> list[Pose]:
        """Both ends of the way."""
        time = self.stop - self.start
        return [REST, ((self.velocity[0] * time, self.velocity[1] * time), 0.0)]


class Oscillate(Motion):
    """Harmonic motion along a line, about the center, or both, from rest position.

    After a time T it is at amplitude x (sin(2 pi f T + phase) - sin(phase)). At a phase
    of 90 or -90 degrees it starts from one end of its way, without a jerk.
    """

    MOVE = "oscillate(t, motion)"

    type: Literal["oscillate"] = about("neutral", "kind of motion")
    amplitude: Vec2 = about("position", "amplitude of place", "m", default=(0.0, 0.0))
    amplitude_deg: float = about(
        "neutral", "amplitude of turn", "deg", default=0.0, ge=-180.0, le=180.0
    )
    frequency: float = about("neutral", "cycles per time", "Hz", gt=0.0, le=50.0)
    phase_deg: float = about(
        "neutral", "phase at the start", "deg", default=0.0, ge=-360.0, le=360.0
    )

    @model_validator(mode="after")
    def _moves(self) -> "Oscillate":
        if not (any(self.amplitude) or self.amplitude_deg):
            raise ValueError(
                "kinematics.amplitude and amplitude_deg are 0, one of them must differ "
                "from 0; a collider that rests is a static_collider"
            )
        return self

    def fastest(self, reach: float) -> float:
        """Speed in the middle of the swing."""
        swing = math.hypot(*self.amplitude)
        swing += math.radians(abs(self.amplitude_deg)) * reach
        return 2.0 * math.pi * self.frequency * swing

    def poses(self) -> list[Pose]:
        """Poses from one end of the swing to the other."""
        middle = -math.sin(math.radians(self.phase_deg))
        (x, y), turn = self.amplitude, math.radians(self.amplitude_deg)
        parts = np.linspace(middle - 1.0, middle + 1.0, POSES).tolist()
        return [((x * part, y * part), turn * part) for part in parts]


class Conveyor(Motion):
    """Belt around the shape, which stays where it is: clockwise if positive."""

    MOVE = "conveyor(t, motion)"

    type: Literal["conveyor"] = about("neutral", "kind of motion")
    surface_speed: float = about("neutral", "speed of the belt", "m/s", ge=-20, le=20)

    def fastest(self, reach: float) -> float:
        """Speed of the belt."""
        return abs(self.surface_speed)

    def poses(self) -> list[Pose]:
        """Rest."""
        return [REST]


Kinematics = Annotated[
    Conveyor | Oscillate | Rotate | Translate, Field(discriminator="type")
]
MOTIONS: dict[str, type[Motion]] = {
    "conveyor": Conveyor,
    "oscillate": Oscillate,
    "rotate": Rotate,
    "translate": Translate,
}
