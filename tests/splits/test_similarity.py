"""Scenes are alike by what they hold, by their numbers, and by what is seen first."""

import copy
import math

import numpy as np
import pytest
from hypothesis import given, settings

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.similarity import (
    MOST_ALIKE,
    config_distance,
    first_frame_distance,
    layout_image,
    signature,
    structure,
)
from tests.sim.scenes import (
    BELT,
    BODY,
    BOWL,
    EGG,
    FAN,
    JET,
    LIQUID,
    OBSTACLE,
    scene_data,
    scenes,
)

few = settings(max_examples=20, deadline=None)


def ball(i, x=None, y=0.5, **other):
    """One of several circles side by side."""
    center = [0.15 + 0.13 * i if x is None else x, y]
    shape = {"type": "circle", "center": center, "radius": 0.05}
    return BODY | {"name": f"ball_{i}", "shape": shape} | other


def scene_of(*things, **other):
    return Scene.from_data(scene_data(*things, **other))


def disguised(scene):
    """The same scene with other names, colours, order and seed."""
    data = copy.deepcopy(scene.to_data())
    data["simulation"]["seed"] += 7
    data["objects"].reverse()
    used = list(dict.fromkeys(o["visualization"]["color"] for o in data["objects"]))
    turned = dict(zip(used, used[1:] + used[:1], strict=True))
    for i, thing in enumerate(data["objects"]):
        thing["name"] = f"thing_{i}"
        thing["visualization"]["color"] = turned[thing["visualization"]["color"]]
    return Scene.from_data(data)


def shifted(scene, number, way):
    """The same scene with an object moved to the right."""
    data = copy.deepcopy(scene.to_data())
    data["objects"][number]["shape"]["center"][0] += way
    return Scene.from_data(data)


BASE = scene_of(BODY, OBSTACLE, FAN, JET)
BALLS = scene_of(*(ball(i) for i in range(MOST_ALIKE)))


# ---- structure


def test_a_structure_is_a_canonical_text():
    assert structure(scene_of(ball(0), OBSTACLE, ball(1), JET)) == (
        "2 dynamic_body circle elastic; emitter box liquid jet; static_collider polygon"
    )


@few
@given(scenes)
def test_names_colours_order_and_seed_are_no_part_of_a_structure(scene):
    assert structure(disguised(scene)) == structure(scene)


@pytest.mark.parametrize(
    "things",
    [
        (BODY, OBSTACLE, FAN),
        (BODY, OBSTACLE, FAN, JET, ball(4, 0.5, 0.8)),
        (BODY | {"physics_properties": LIQUID}, OBSTACLE, FAN, JET),
        (EGG, OBSTACLE, FAN, JET),
        (BODY, BOWL, FAN, JET),
        (BODY, OBSTACLE, BELT, JET),
    ],
)
def test_objects_shapes_materials_and_motions_are_a_structure(things):
    other = scene_of(*things)
    assert structure(other) != structure(BASE)
    assert config_distance(BASE, other) == math.inf


# ---- numbers


@few
@given(scenes)
def test_a_scene_is_at_no_distance_from_itself_in_disguise(scene):
    assert config_distance(scene, scene) == 0.0
    assert config_distance(scene, disguised(scene)) == 0.0


@few
@given(scenes, scenes)
def test_a_distance_is_symmetric_and_never_negative(one, other):
    distance = config_distance(one, other)
    assert distance == config_distance(other, one) >= 0.0
    assert (distance < math.inf) == (structure(one) == structure(other))


def test_a_distance_grows_with_a_shift():
    distances = [config_distance(BASE, shifted(BASE, 0, d)) for d in (0.01, 0.03, 0.09)]
    assert 0.0 < distances[0] < distances[1] < distances[2] < 0.1
    assert distances[2] == pytest.approx(9 * distances[0], rel=1e-6)


def change(path, value):
    """The base scene with another value at a path."""
    data = copy.deepcopy(BASE.to_data())
    node = data
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value
    return Scene.from_data(data)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("environment", "gravity"), [1.0, -9.8]),
        (("environment", "walls", "contact"), "sticky"),
        (("environment", "walls", "friction"), 0.4),
        (("objects", 0, "shape", "size"), [0.2, 0.12]),
        (("objects", 0, "shape", "angle_deg"), 15.0),
        (("objects", 0, "physics_properties", "youngs_modulus"), 1e5),
        (("objects", 0, "initial_state", "velocity"), [1.0, 0.0]),
        (("objects", 1, "contact", "type"), "sticky"),
        (("objects", 2, "kinematics", "angular_velocity"), -4.0),
        (("objects", 3, "emission", "velocity"), [0.2, -1.5]),
        (("objects", 3, "emission", "stop"), 0.3),
    ],
    ids=lambda value: ".".join(map(str, value)) if isinstance(value, tuple) else "",
)
def test_every_number_that_moves_matter_counts(path, value):
    other = change(path, value)
    assert 0.0 < config_distance(BASE, other) < math.inf
    assert not np.array_equal(signature(BASE), signature(other))


def test_a_rate_of_particles_does_not_count():
    other = change(("objects", 3, "emission", "rate"), 380.0)
    assert config_distance(BASE, other) == 0.0


def test_scenes_of_a_structure_have_as_many_numbers():
    assert signature(BASE).shape == signature(shifted(BASE, 1, 0.1)).shape
    assert np.isfinite(signature(BASE)).all()


def test_objects_of_a_kind_are_matched_at_their_best():
    light, heavy = (
        BODY["physics_properties"] | {"density": density} for density in (500.0, 5e3)
    )
    one = scene_of(
        ball(0, 0.50, 0.3, physics_properties=light),
        ball(1, 0.51, 0.7, physics_properties=heavy),
    )
    other = scene_of(  # moved by 2 cm, so that the order from left to right is another
        ball(0, 0.52, 0.3, physics_properties=light),
        ball(1, 0.51, 0.7, physics_properties=heavy),
    )
    crossed = scene_of(
        ball(0, 0.50, 0.3, physics_properties=heavy),
        ball(1, 0.51, 0.7, physics_properties=light),
    )
    assert config_distance(one, other) < 0.003 < config_distance(one, crossed)


@pytest.mark.parametrize("count", [MOST_ALIKE, MOST_ALIKE + 2])
def test_also_many_objects_of_a_kind_in_disguise_are_at_no_distance(count):
    scene = scene_of(*(ball(i) for i in range(count)))
    assert config_distance(scene, disguised(scene)) == 0.0
    assert 0.0 < config_distance(scene, shifted(scene, count - 1, 0.01)) < 0.01


# ---- what is seen first


def test_scenes_that_cover_the_same_pixels_are_at_no_distance():
    assert first_frame_distance(BASE, BASE) == 0.0
    assert first_frame_distance(BASE, disguised(BASE)) == 0.0


def test_scenes_that_share_no_pixel_are_at_distance_one():
    one, other = scene_of(ball(0)), scene_of(ball(4))
    assert first_frame_distance(one, other) == 1.0


def test_scenes_that_show_nothing_yet_are_at_no_distance():
    assert first_frame_distance(scene_of(JET), scene_of(JET)) == 0.0
    assert first_frame_distance(scene_of(JET), scene_of(JET, ball(0))) == 1.0


def test_a_distance_of_first_frames_grows_with_a_shift():
    one = scene_of(BODY)
    distances = [
        first_frame_distance(one, shifted(one, 0, way), 256) for way in (0.02, 0.1)
    ]
    overlap = [(0.2 - way) / (0.2 + way) for way in (0.02, 0.1)]
    np.testing.assert_allclose(distances, 1.0 - np.array(overlap), atol=0.03)


def test_a_layout_shows_colours_where_objects_are():
    image = layout_image(scene_of(BODY, OBSTACLE, JET), 100)
    assert image.shape == (100, 100, 3)
    assert image[30, 25].tolist() == [0xF5, 0x2D, 0x2C]  # at y = 0.7: top row first
    assert image[75, 25].tolist() == [0x96, 0x96, 0x96]
    assert not image[15, 70].any()  # of a nozzle, nothing


def test_a_layout_is_about_the_first_frame_of_the_program():
    scene = scene_of(BODY, OBSTACLE, FAN, frames=1, pixels=256)
    frame = run(link(scene), 1, timeout=120).expect()[0]
    image = layout_image(scene, 256)
    shown, drawn = image.any(axis=2), frame.any(axis=2)
    assert (shown & drawn).sum() > 0.9 * (shown | drawn).sum()
    assert (image == frame).all(axis=2)[shown & drawn].mean() > 0.98
