"""The objects of a scene: dynamic bodies, colliders and emitters."""

from typing import Annotated, Literal

from pydantic import Field

from mpmworlds.sim.emissions import AnyEmission
from mpmworlds.sim.materials import AnyMaterial, EmittedMaterial
from mpmworlds.sim.motions import Kinematics
from mpmworlds.sim.scene.fields import Color, Part, Vec2, about
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
    shape: Box = about("neutral", "nozzle; its extent across the velocity counts")
    physics_properties: EmittedMaterial = about("neutral", "material")
    emission: AnyEmission = about("neutral", "what leaves the nozzle")


AnyObject = Annotated[
    DynamicBody | StaticCollider | KinematicCollider | Emitter,
    Field(discriminator="object_type"),
]
