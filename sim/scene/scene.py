"""The scene: a validated, immutable description that determines a sample.

A `Scene` that exists is valid: fields, layout and numerics have been checked. Schema
`mpmworlds-scene/1`; units are metres in a square of 1 m, seconds, and kg per area.
"""

from typing import Any

from pydantic import TypeAdapter, ValidationError

from mpmworlds.sim.scene.checks import check_scene
from mpmworlds.sim.scene.errors import SceneError as SceneError
from mpmworlds.sim.scene.errors import describe, raise_faults
from mpmworlds.sim.scene.objects import AnyObject
from mpmworlds.sim.scene.sections import MOST_OBJECTS, Sections
from mpmworlds.sim.scene.sections import SCHEMA as SCHEMA
from mpmworlds.sim.scene.text import dump_yaml, parse_yaml

FIRST = ("schema", "name", "object_type", "type", "constitutive_model")
LAST = ("start", "stop", "visualization", "output")
ONE_OBJECT: TypeAdapter[AnyObject] = TypeAdapter(AnyObject)


class Scene(Sections):
    """A scene; see the module. Build one with `from_yaml` or `from_data`."""

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
        if isinstance(objects := data.get("objects"), list):
            if len(objects) > MOST_OBJECTS:  # before each of them is looked at
                many = f"has {len(objects)} objects, must have <= {MOST_OBJECTS}"
                raise SceneError(source, [f"{many}; leave some out"])
            data = data | {"objects": tuple(objects)}
        try:
            scene = cls.model_validate(data)
        except ValidationError as error:
            raise SceneError(source, describe(error, data)) from None
        raise_faults(source, check_scene(scene))
        return scene

    @classmethod
    def from_yaml(cls, text: str, source: str = "scene.yaml") -> "Scene":
        """Parse and validate a scene file; raises `SceneError` like `from_data`."""
        return cls.from_data(parse_yaml(text, source), source)

    @property
    def materials(self) -> frozenset[str]:
        """Names of the constitutive models of its matter and rigid bodies."""
        return frozenset(
            thing.physics_properties.constitutive_model
            for thing in self.objects
            if hasattr(thing, "physics_properties")
        )

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
        raise_faults(source, check_scene(scene, number))
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
