"""The objects of a scene: dynamic bodies, colliders and emitters.

`MOVE` is the expression of a program that gives the displacement of a motion and its
rate at time `t`; it reads the parameters as `motion["name"]`.
"""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from mpmworlds.sim.fields import Color, Part, Vec2, about
from mpmworlds.sim.materials import AnyMaterial
from mpmworlds.sim.shapes import Box, Shape

Law = Literal["sticky", "slip", "separate"]


class Contact(Part):
    """What a surface does to the grid velocity next to it."""

    type: Law = about("neutral", "contact law", default="separate")
    friction: float = about("neutral", "Coulomb coefficient", default=0.0, ge=0, le=10)
    skin_cells: float = about(
        "neutral", "distance at which it acts", "cells", default=0.3, ge=0.0, le=1.0
    )


class InitialState(Part):
    """Motion of a body when the scene starts."""

    velocity: Vec2 = about("position", "velocity", "m/s", default=(0.0, 0.0))
    angular_velocity: float = about(
        "position", "spin about the center", "rad/s", default=0.0, ge=-100, le=100
    )


class Visualization(Part):
    """How an object looks."""

    color: Color = about("appearance", "flat colour")


class Rotate(Part):
    """Constant spin about the center of the shape."""

    MOVE: ClassVar[str] = 'rotate(t, motion["angular_velocity"])'

    type: Literal["rotate"] = about("neutral", "kind of motion")
    angular_velocity: float = about("neutral", "spin", "rad/s", ge=-100.0, le=100.0)


class Translate(Part):
    """Constant velocity between two times, at rest before and after."""

    MOVE: ClassVar[str] = (
        'translate(t, motion["velocity"], motion["start"], motion["stop"])'
    )

    type: Literal["translate"] = about("neutral", "kind of motion")
    velocity: Vec2 = about("position", "velocity while it moves", "m/s")
    start: float = about("neutral", "when it starts", "s", ge=0.0, le=100.0)
    stop: float = about("neutral", "when it stops", "s", gt=0.0, le=100.0)

    @model_validator(mode="after")
    def _order(self) -> "Translate":
        if self.stop <= self.start:
            raise ValueError(
                f"kinematics.stop = {self.stop}, must be > start = {self.start}"
            )
        return self


Kinematics = Annotated[Rotate | Translate, Field(discriminator="type")]
MOTIONS: dict[str, type[Rotate] | type[Translate]] = {
    "rotate": Rotate,
    "translate": Translate,
}


class Emission(Part):
    """A jet of particles that leaves the nozzle evenly in space and time."""

    rate: float = about("neutral", "particles per time", "1/s", gt=0.0, le=1e6)
    velocity: Vec2 = about("position", "velocity of the jet", "m/s")
    start: float = about("neutral", "when it starts", "s", default=0.0, ge=0, le=100)
    stop: float = about("neutral", "when it stops", "s", gt=0.0, le=100.0)

    @model_validator(mode="after")
    def _order(self) -> "Emission":
        if self.stop <= self.start:
            raise ValueError(
                f"emission.stop = {self.stop}, must be > start = {self.start}"
            )
        if max(map(abs, self.velocity)) < 0.05:
            raise ValueError(
                f"emission.velocity = {list(self.velocity)}, must be faster than "
                "0.05 m/s, or the jet never leaves the nozzle"
            )
        return self


class Thing(Part):
    """What every object has."""

    name: str = about(
        "neutral", "neutral and unique name", pattern="^[a-z][a-z0-9_]{0,31}$"
    )
    visualization: Visualization = about("neutral", "looks")


class DynamicBody(Thing):
    """A body of particles."""

    object_type: Literal["dynamic_body"] = about("neutral", "role in the scene")
    shape: Shape = about("neutral", "shape and place")
    physics_properties: AnyMaterial = about("neutral", "material")
    initial_state: InitialState = about(
        "neutral", "initial motion", default=InitialState()
    )


class StaticCollider(Thing):
    """A rigid obstacle that never moves."""

    object_type: Literal["static_collider"] = about("neutral", "role in the scene")
    shape: Shape = about("neutral", "shape and place")
    contact: Contact = about("neutral", "contact", default=Contact())


class KinematicCollider(Thing):
    """A rigid obstacle with a prescribed motion that nothing can stop."""

    object_type: Literal["kinematic_collider"] = about("neutral", "role in the scene")
    shape: Shape = about("neutral", "shape and place when the scene starts")
    kinematics: Kinematics = about("neutral", "motion")
    contact: Contact = about("neutral", "contact", default=Contact())


class Emitter(Thing):
    """A nozzle that releases particles."""

    object_type: Literal["emitter"] = about("neutral", "role in the scene")
    shape: Box = about("neutral", "nozzle; its extent across the jet counts")
    physics_properties: AnyMaterial = about("neutral", "material")
    emission: Emission = about("neutral", "jet")


AnyObject = Annotated[
    DynamicBody | StaticCollider | KinematicCollider | Emitter,
    Field(discriminator="object_type"),
]
