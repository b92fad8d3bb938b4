"""A scene that exists is valid, and an invalid one is told what to change."""

import copy
import math
from typing import get_args

import jsonschema
import pydantic
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.scene.fields import Part, Tag, about, tag_of
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene, SceneError, json_schema
from tests.sim.scenes import scene_data, scenes

BODY, OBSTACLE, FAN, JET = (f"objects[{i}] 'object_{i}'" for i in range(4))
GONE = object()
FAULTS = [
    (("weather",), 1, "weather is not a known key; remove it or check its spelling"),
    (("simulation", "dt"), 1, "simulation.dt is not a known key; "),
    (("objects", 0, "mass"), 1.0, f"{BODY}: mass is not a known key; "),
    (("objects", 3, "shape", "radius"), 1.0, f"{JET}: shape.radius is not a known key"),
    (("output",), GONE, "output is missing; add it"),
    (("schema",), GONE, "schema is missing; add it"),
    (("objects", 2, "name"), GONE, "objects[2]: name is missing; add it"),
    (("objects", 0, "shape", "size"), GONE, f"{BODY}: shape.size is missing; add it"),
    (("objects", 0, "object_type"), GONE, f"{BODY}: object_type is missing; "),
    (("objects", 0, "shape", "type"), GONE, f"{BODY}: shape.type is missing; "),
    (("schema",), "other/1", "schema = 'other/1', must be 'mpmworlds-scene/1'"),
    (("simulation",), [], "simulation = [], must be a mapping"),
    (("simulation", "seed"), "7", "simulation.seed = '7', must be a whole number"),
    (("simulation", "seed"), 7.0, "simulation.seed = 7.0, must be a whole number"),
    (("simulation", "seed"), True, "simulation.seed = True, must be a whole number"),
    (("simulation", "seed"), -1, "simulation.seed = -1, must be >= 0"),
    (("simulation", "grid_resolution"), 16, "grid_resolution = 16, must be >= 32"),
    (("environment", "gravity"), [0.0], "environment.gravity[1] is missing; add it"),
    (("environment", "gravity"), 9.8, "environment.gravity = 9.8, must be a list"),
    (
        ("environment", "gravity"),
        [0.0, -math.inf],
        "environment.gravity[1] = -inf, must be a finite number",
    ),
    (("objects",), [], "objects = [], needs at least 1 entries"),
    (("objects",), {}, "objects = {}, must be a list"),
    (("objects", 1), "rock", "objects[1]: object = 'rock', must be a mapping"),
    (
        ("objects", 0, "name"),
        "Box 1",
        "objects[0] 'Box 1': name = 'Box 1', must match",
    ),
    (("objects", 0, "shape"), "box", f"{BODY}: shape = 'box', must be a mapping"),
    (
        ("objects", 0, "shape", "center"),
        [math.nan, 0.7],
        f"{BODY}: shape.center[0] = nan, must be a finite number",
    ),
    (
        ("objects", 0, "shape", "size"),
        [0.0, 0.1],
        f"{BODY}: shape.size = [0.0, 0.1], both must be > 0 and <= 1",
    ),
    (
        ("objects", 2, "shape", "blade_length"),
        0.0,
        f"{FAN}: shape.blade_length = 0.0, must be > 0.0",
    ),
    (
        ("objects", 0, "shape", "type"),
        "star",
        f"{BODY}: shape.type = 'star', must be one of 'box', 'capsule', 'circle'",
    ),
    (
        ("objects", 0, "object_type"),
        "ghost",
        f"{BODY}: object_type = 'ghost', must be one of 'dynamic_body', ",
    ),
    (
        ("objects", 0, "physics_properties", "constitutive_model"),
        "jam",
        f"{BODY}: physics_properties.constitutive_model = 'jam', must be one of ",
    ),
    (
        ("objects", 0, "physics_properties", "poissons_ratio"),
        0.5,
        f"{BODY}: physics_properties.poissons_ratio = 0.5, must be <= 0.45",
    ),
    (
        ("objects", 1, "visualization", "color"),
        "#959697",
        (
            f"{OBSTACLE}: visualization.color = '#959697', must be one of the "
            f"{len(PALETTE)} palette colours, which survive video encoding exactly; "
            f"the nearest is '{PALETTE['grey']}'"
        ),
    ),
    (
        ("objects", 1, "shape", "vertices"),
        [[-0.1, -0.1], [0.1, 0.1], [0.1, -0.1], [-0.1, 0.1]],
        f"{OBSTACLE}: shape.vertices cross; list the corners in order",
    ),
    (
        ("objects", 1, "shape", "vertices"),
        [[0.0, 0.0], [0.1, 0.1], [0.2, 0.2]],
        f"{OBSTACLE}: shape.vertices enclose no area; move a vertex",
    ),
    (
        ("objects", 1, "shape", "vertices"),
        [[0.0, 0.0], [0.1, 0.1]],
        f"{OBSTACLE}: shape.vertices = [[0.0, 0.0], [0.1, 0.1]], needs at least 3",
    ),
    (
        ("objects", 2, "kinematics"),
        {"type": "translate", "velocity": [1.0, 0.0], "start": 1.0, "stop": 1.0},
        f"{FAN}: kinematics.stop = 1.0, must be > start = 1.0",
    ),
    (
        ("objects", 3, "emission", "start"),
        1.0,
        f"{JET}: emission.stop = 0.2, must be > start = 1.0",
    ),
    (
        ("objects", 3, "emission", "velocity"),
        [0.0, 0.01],
        f"{JET}: emission.velocity = [0.0, 0.01], must be faster than 0.05 m/s",
    ),
]


def changed(data, path, value):
    """A copy of plain data in which the place at `path` has another value, or none."""
    data = copy.deepcopy(data)
    place = data
    for key in path[:-1]:
        place = place[key]
    if value is GONE:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return data


def leaves(node, path=()):
    """Paths of everything in plain data."""
    if path:
        yield path
    if isinstance(node, dict | list):
        items = node.items() if isinstance(node, dict) else enumerate(node)
        for key, value in items:
            yield from leaves(value, (*path, key))


@pytest.mark.parametrize(("path", "value", "message"), FAULTS)
def test_a_fault_names_file_object_field_value_and_rule(path, value, message):
    data = changed(scene_data(), path, value)
    with pytest.raises(SceneError) as error:
        Scene.from_data(data, "scene.yaml")
    assert len(error.value.faults) == 1
    assert str(error.value).startswith("scene.yaml: ")
    assert message in str(error.value)


def test_every_fault_is_told_at_once():
    data = changed(scene_data(), ("objects", 0, "mass"), 1.0)
    data = changed(data, ("simulation", "seed"), -1)
    with pytest.raises(SceneError) as error:
        Scene.from_data(data)
    assert len(error.value.faults) == 2


@settings(max_examples=100, deadline=None)
@given(
    path=st.sampled_from(list(leaves(scene_data()))),
    value=st.one_of(
        st.sampled_from([None, "", "x", [], {}, [[]], [{}], {"type": []}, True, 1e300]),
        st.integers(-(2**70), 2**70),
        st.floats(allow_subnormal=False),  # taichi, where loaded, flushes them to 0
    ),
)
def test_any_value_anywhere_is_accepted_or_refused_with_a_scene_error(path, value):
    try:
        scene = Scene.from_data(changed(scene_data(), path, value))
    except SceneError:
        return
    assert Scene.from_yaml(scene.to_yaml()) == scene


@settings(max_examples=20, deadline=None)
@given(scenes)
def test_canonical_text_reads_back_as_the_scene_and_is_a_fixed_point(scene):
    text = scene.to_yaml()
    again = Scene.from_yaml(text)
    assert again == scene
    assert again.to_yaml() == text
    assert text.isascii()


def test_letter_case_of_a_colour_is_not_part_of_a_scene():
    path = ("objects", 0, "visualization", "color")
    lower = changed(scene_data(), path, PALETTE["red"].lower())
    assert Scene.from_data(lower).objects[0].visualization.color == PALETTE["red"]


def test_a_scene_cannot_be_changed_in_place():
    scene = Scene.from_data(scene_data())
    for part, name in [
        (scene, "output"),
        (scene.simulation, "seed"),
        (scene.objects[0], "name"),
        (scene.objects[0].shape, "center"),
    ]:
        with pytest.raises(pydantic.ValidationError, match="frozen"):
            setattr(part, name, getattr(part, name))


def test_plain_data_is_a_copy():
    scene = Scene.from_data(scene_data())
    scene.to_data()["objects"][0]["shape"]["center"][0] = 9.0
    assert scene.to_data() == scene_data()


def test_an_edited_copy_is_validated():
    scene = Scene.from_data(scene_data())
    assert scene.edited(output={"resolution": 32, "framerate": 5}) != scene
    with pytest.raises(SceneError, match="framerate"):
        scene.edited(output={"resolution": 32, "framerate": 0})


def parts_of(model=Part):
    """Every part of the schema."""
    for child in model.__subclasses__():
        yield child
        yield from parts_of(child)


@pytest.mark.parametrize("model", list(parts_of()), ids=lambda model: model.__name__)
def test_every_field_carries_a_tag_and_says_what_it_is(model):
    for name, field in model.model_fields.items():
        assert tag_of(model, name) in get_args(Tag)
        assert field.description


def test_a_field_without_a_tag_is_a_programming_error():
    class Untagged(pydantic.BaseModel):
        mass: float = 1.0

    with pytest.raises(TypeError, match=r"Untagged\.mass carries no tag"):
        tag_of(Untagged, "mass")


def test_a_number_without_a_kind_is_a_programming_error():
    with pytest.raises(TypeError, match=r"Kindless\.mass is a number without a kind"):

        class Kindless(Part):
            mass: float = about("neutral", "mass", "kg")

    with pytest.raises(TypeError, match="kind = 'weight', must be one of position, "):
        about("neutral", "mass", "kg", kind="weight")


def test_json_schema_accepts_valid_scenes():
    validator = jsonschema.Draft202012Validator(json_schema())
    validator.check_schema(json_schema())
    for data in (scene_data(), *(scene.to_data() for scene in load_seeds().values())):
        validator.validate(data)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("weather",), 1),
        (("objects", 0, "mass"), 1.0),
        (("objects", 0, "shape", "radius"), 0.1),
        (("output",), GONE),
        (("simulation", "grid_resolution"), 16),
        (("objects", 0, "shape", "center"), [0.5]),
        (("objects", 0, "visualization", "color"), "red"),
        (("objects", 0, "object_type"), "ghost"),
    ],
)
def test_json_schema_refuses_what_the_schema_refuses(path, value):
    data = changed(scene_data(), path, value)
    assert not jsonschema.Draft202012Validator(json_schema()).is_valid(data)
