"""The scene: a validated, immutable description that determines a sample.

A `Scene` that exists is valid: fields, layout and numerics have been checked. Schema
`mpmworlds-scene/1`; units are metres in a square of 1 m, seconds, and kg per area.
"""

from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from mpmworlds.sim.checks import check_scene
from mpmworlds.sim.errors import SceneError as SceneError
from mpmworlds.sim.errors import describe
from mpmworlds.sim.fields import Part, Vec2, about
from mpmworlds.sim.objects import AnyObject, Law
from mpmworlds.sim.text import dump_yaml, parse_yaml

SCHEMA = "mpmworlds-scene/1"
FIRST = ("schema", "name", "object_type", "type", "constitutive_model")
ONE_OBJECT: TypeAdapter[AnyObject] = TypeAdapter(AnyObject)
LAST = ("start", "stop", "visualization", "output")


class Simulation(Part):
    """Resolution and length of the simulation."""

    grid_resolution: int = about("neutral", "cells per side", ge=32, le=512)
    time_step_dt: float = about("neutral", "time step", "s", gt=0.0, le=1e-2)
    substeps_per_frame: int = about("neutral", "time steps per frame", ge=1, le=10000)
    duration_frames: int = about("neutral", "frames of the video", ge=1, le=10000)
    particles_per_cell: int = about("neutral", "particles per cell", ge=1, le=16)
    seed: int = about("neutral", "seed of the initial jitter", ge=0, lt=2**63)


class Walls(Part):
    """The four walls of the domain."""

    contact: Law = about("neutral", "contact law", default="separate")
    friction: float = about("neutral", "Coulomb coefficient", default=0.0, ge=0, le=10)
    thickness_cells: int = about(
        "neutral", "thickness", "cells", default=3, ge=3, le=32
    )


class Environment(Part):
    """What surrounds the objects."""

    gravity: Vec2 = about("neutral", "gravity", "m/s^2", default=(0.0, -9.8))
    walls: Walls = about("neutral", "walls of the domain", default=Walls())


class Output(Part):
    """The video."""

    resolution: int = about("neutral", "pixels per side, even", ge=32, le=1024)
    framerate: int = about("neutral", "frames per second", ge=1, le=120)


class Scene(Part):
    """A scene; see the module. Build one with `from_yaml` or `from_data`."""

    schema_: Literal["mpmworlds-scene/1"] = about(
        "neutral", "schema of this file", alias="schema"
    )
    simulation: Simulation = about("neutral", "resolution and length")
    environment: Environment = about("neutral", "surroundings", default=Environment())
    objects: tuple[AnyObject, ...] = about("neutral", "objects", min_length=1)
    output: Output = about("neutral", "video")

    @classmethod
    def from_data(cls, data: Any, source: str = "scene") -> "Scene":
        """Validate the plain data of a scene (dicts, lists, numbers, strings).

        Raises
        ------
        SceneError
            Naming `source`, object, field, value, rule and remedy of every fault.
        """
        if not isinstance(data, dict):
            raise SceneError(
                source, ["must be a mapping with keys schema, simulation, objects, ..."]
            )
        if isinstance(data.get("objects"), list):
            data = data | {"objects": tuple(data["objects"])}
        try:
            scene = cls.model_validate(data)
        except ValidationError as error:
            raise SceneError(source, describe(error, data)) from None
        faults = check_scene(scene)
        if faults:
            raise SceneError(source, faults)
        return scene

    @classmethod
    def from_yaml(cls, text: str, source: str = "scene.yaml") -> "Scene":
        """Parse and validate a scene file; raises `SceneError` like `from_data`."""
        return cls.from_data(parse_yaml(text, source), source)

    def with_object(self, number: int, data: Any, source: str = "scene") -> "Scene":
        """A validated copy in which one object is another, given as plain data.

        Only what depends on that object is checked, so it is quick.

        Raises
        ------
        SceneError
            As `from_data`.
        """
        try:
            thing = ONE_OBJECT.validate_python(data)
        except ValidationError as error:
            raise SceneError(source, describe(error, data)) from None
        before, after = self.objects[:number], self.objects[number + 1 :]
        scene = self.model_copy(update={"objects": (*before, thing, *after)})
        faults = check_scene(scene, number)
        if faults:
            raise SceneError(source, faults)
        return scene

    def to_data(self) -> dict[str, Any]:
        """Plain data with every field present, in schema order."""
        data: dict[str, Any] = _ordered(self.model_dump(mode="json", by_alias=True))
        return data

    def to_yaml(self) -> str:
        """Canonical text: every field, schema order, one layout."""
        return dump_yaml(self.to_data())

    def edited(self, source: str = "scene", **sections: Any) -> "Scene":
        """A validated copy with top-level sections replaced by plain data."""
        return Scene.from_data(self.to_data() | sections, source)


def _ordered(data: Any) -> Any:
    """Mappings with what a thing is first, and its times and looks last."""
    if isinstance(data, dict):
        first = [key for key in FIRST if key in data]
        last = [key for key in LAST if key in data]
        rest = [key for key in data if key not in FIRST + LAST]
        return {key: _ordered(data[key]) for key in first + rest + last}
    return [_ordered(item) for item in data] if isinstance(data, list) else data


def json_schema() -> dict[str, Any]:
    """JSON Schema of a scene file, for editors and other tools."""
    schema = Scene.model_json_schema(by_alias=True)
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect} | schema | {"title": SCHEMA}
