"""The objects of a scene: dynamic bodies, colliders and emitters."""

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field

from mpmworlds.sim.program.features import members_of, modules_of
from mpmworlds.sim.program.features.emission import Emission
from mpmworlds.sim.program.features.material import Material
from mpmworlds.sim.program.features.motion import Motion
from mpmworlds.sim.program.features.shape import Shape
from mpmworlds.sim.program.features.shapes.box import Box
from mpmworlds.sim.scene.fields import Color, Part, Vec2, about

MATERIALS = members_of("materials", Material, "constitutive_model")
SHAPES = members_of("shapes", Shape, "type")
MOTIONS = members_of("motions", Motion, "type")
EMISSIONS = members_of("emissions", Emission, "type")
CONTACTS = tuple(m.__name__.rpartition(".")[2] for m in modules_of("contacts"))
RELEASED = {name: kind for name, kind in MATERIALS.items() if kind.FLOWS}


def _typed(data: Any) -> Any:
    """An emission that does not say of which type it is, is a jet."""
    return {"type": "jet"} | data if isinstance(data, dict) else data


def _any_of(kinds: dict[str, Any]) -> Any:
    """The union of types."""
    return reduce(or_, kinds.values())


if TYPE_CHECKING:  # the members are found when the program runs
    AnyMaterial: TypeAlias = Material
    EmittedMaterial: TypeAlias = Material
    AnyShape: TypeAlias = Shape
    Kinematics: TypeAlias = Motion
    AnyEmission: TypeAlias = Emission
    Law: TypeAlias = str
else:
    _model = Field(discriminator="constitutive_model")
    AnyMaterial = Annotated[_any_of(MATERIALS), _model]
    EmittedMaterial = Annotated[_any_of(RELEASED), _model]
    AnyShape = Annotated[_any_of(SHAPES), Field(discriminator="type")]
    Kinematics = Annotated[_any_of(MOTIONS), Field(discriminator="type")]
    _emission = Annotated[_any_of(EMISSIONS), Field(discriminator="type")]
    AnyEmission = Annotated[_emission, BeforeValidator(_typed)]
    Law = Literal[CONTACTS]


class Contact(Part):
    """What a surface does to the grid velocity next to it."""

    type: Law = about("neutral", "contact law", default="separate")
    friction: float = about(
        "neutral", "Coulomb coefficient", default=0.0, ge=0, le=10, kind="friction"
    )
    skin_cells: float = about(
        "neutral",
        "distance at which it acts",
        "cells",
        default=0.3,
        ge=0.0,
        le=1.0,
        kind="setting",
    )


class InitialState(Part):
    """Motion of a body when the scene starts."""

    velocity: Vec2 = about(
        "position", "velocity", "m/s", default=(0.0, 0.0), kind="velocity"
    )
    angular_velocity: float = about(
        "position",
        "spin about the center",
        "rad/s",
        default=0.0,
        ge=-100,
        le=100,
        kind="spin",
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
    shape: AnyShape = about("neutral", "shape and place")
    physics_properties: AnyMaterial = about("neutral", "material")
    initial_state: InitialState = about(
        "neutral", "initial motion", default=InitialState()
    )


class StaticCollider(Thing):
    """A rigid obstacle that never moves."""

    object_type: Literal["static_collider"] = about("neutral", "role in the scene")
    shape: AnyShape = about("neutral", "shape and place")
    contact: Contact = about("neutral", "contact", default=Contact())


class KinematicCollider(Thing):
    """A rigid obstacle with a prescribed motion that nothing can stop."""

    object_type: Literal["kinematic_collider"] = about("neutral", "role in the scene")
    shape: AnyShape = about("neutral", "shape and place when the scene starts")
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
