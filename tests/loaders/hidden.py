"""Scenes that differ in nothing but what a regime hides, by the tags of the schema."""

from functools import cache

from mpmworlds.builder.plan.manifest import read_table, recorded_manifest
from mpmworlds.sim.scene.fields import Part, parts_of, tag_of
from mpmworlds.sim.scene.objects import MATERIALS
from mpmworlds.sim.scene.scene import Scene
from tests.tables import newest_tables

STRIDE = 37  # of the rows of the full corpus that are looked at
HIDDEN = {"no_materials": "material", "no_positions": "position"}
MATERIAL_WORDS = set(MATERIALS) | {
    name
    for kind in MATERIALS.values()
    for name in kind.model_fields
    if tag_of(kind, name) == "material"
} - {"friction", "skin_cells"}  # walls and solids have them, too


@cache
def corpus():
    """Thousands of scenes of all kinds."""
    texts = read_table(recorded_manifest("full"), ["id", "scene"]).to_pylist()
    return [Scene.from_yaml(row["scene"], row["id"]) for row in texts[::STRIDE]]


def other(part, tag, random):
    """A part with other values wherever a field has a tag; it may be no valid one."""
    changed = {}
    for name in type(part).model_fields:
        value = getattr(part, name)
        if tag_of(type(part), name) in (tag, "derived"):
            changed[name] = another_value(value, random)
        elif isinstance(value, Part):
            changed[name] = other(value, tag, random)
        elif isinstance(value, tuple) and isinstance(value[0], Part):
            changed[name] = tuple(other(item, tag, random) for item in value)
    if tag == "material" and "physics_properties" in changed:
        changed["physics_properties"] = another_material(part, random)
    return part.model_copy(update=changed)


def another_value(value, random):
    if isinstance(value, str):
        return value
    if isinstance(value, tuple) and isinstance(value[0], tuple):
        value = value[: random.integers(3, len(value) + 1)]
    if isinstance(value, tuple):
        return tuple(another_value(item, random) for item in value)
    if isinstance(value, int):
        return int(random.integers(2, 1 << 20))
    return float(random.uniform(-1.0, 1.0))


def another_material(thing, random):
    """Another constitutive model, with its own parameters."""
    kinds = parts_of(type(thing).model_fields["physics_properties"].annotation)
    kind = kinds[random.integers(len(kinds))]
    (name,) = kind.model_fields["constitutive_model"].annotation.__args__
    return kind(constitutive_model=name, **newest_tables().typical[name])


def numbers_of(part, tags):
    """Every number of the fields of a part that have one of some tags."""
    found = []
    for name in type(part).model_fields:
        value = getattr(part, name)
        if tag_of(type(part), name) in tags:
            found += flat(value)
        elif isinstance(value, Part):
            found += numbers_of(value, tags)
        elif isinstance(value, tuple) and isinstance(value[0], Part):
            for item in value:
                found += numbers_of(item, tags)
    return found


def flat(value):
    """The numbers of a value of a field."""
    if isinstance(value, Part):
        return [
            n for name in type(value).model_fields for n in flat(getattr(value, name))
        ]
    if isinstance(value, tuple):
        return [number for item in value for number in flat(item)]
    return [value] if isinstance(value, int | float) else []
