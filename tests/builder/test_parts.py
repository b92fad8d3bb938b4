"""Sizes, mirror images, colours, motions and materials of single objects."""

import copy
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.parts import (
    BELTS,
    HUE_STEP,
    MATERIALS,
    NOT_EMITTED,
    TIP_SPEED,
    VIVID,
    NoRoomError,
    free_color,
    give_material,
    is_matter,
    material_of,
    mirror,
    renamed,
    rounded,
    scale,
    set_in_motion,
    weighted,
)
from mpmworlds.sim.program.features.emissions.hose import Hose
from mpmworlds.sim.scene.objects import MATERIALS as MODELS
from mpmworlds.sim.scene.objects import MOTIONS, SHAPES
from mpmworlds.sim.scene.palette import PALETTE, hue_difference
from mpmworlds.sim.scene.scene import Scene
from tests.builder.edits import (
    SCENES,
    changes,
    generators,
    image,
    many,
    places,
    things,
)
from tests.sim.scenes import BELT, BODY, BOWL, EGG, FAN, GATE, HOSE, ROCKER, scene_data

LENGTHS = {"radius", "size", "semi_axes", "corner_radius", "length", "blade_length"}


def shape_of(thing):
    """Shape of an object as a scene holds it."""
    return SHAPES[thing["shape"]["type"]].model_validate(thing["shape"])


# ---- numbers


@given(st.floats(-1e6, 1e6))
def test_rounded_numbers_are_short_and_near(value):
    assert rounded(value) == pytest.approx(value, rel=5e-4, abs=5e-5)
    assert rounded(rounded(value)) == rounded(value)


def test_weights_need_not_add_up_to_one():
    rng = np.random.default_rng(0)
    drawn = [weighted(rng, {"a": 6.0, "b": 2.0, "c": 0.0}) for _ in range(400)]
    assert 0.68 < drawn.count("a") / len(drawn) < 0.82
    assert "c" not in drawn


# ---- sizes


@many
@given(things, st.floats(0.5, 1.7).map(rounded))
def test_scaling_scales_lengths_and_what_a_nozzle_lets_through(thing, factor):
    before = copy.deepcopy(thing)
    scale(thing, factor)
    one, other = places(before), places(thing)
    assert one.keys() == other.keys()
    for path, value in one.items():
        scaled = LENGTHS | {"vertices"} if path[0] == "shape" else {"rate"}
        if scaled & set(path):
            assert other[path] == pytest.approx(value * factor, rel=5e-4, abs=1e-4)
        else:
            assert other[path] == value, path


@pytest.mark.parametrize("thing", [EGG, BODY, BELT, ROCKER])
def test_a_scaled_outline_is_that_of_the_shape_seen_from_its_center(thing):
    scaled = copy.deepcopy(thing)
    scale(scaled, 0.8)
    (one,), (other,) = (shape_of(t).local_outline() for t in (thing, scaled))
    np.testing.assert_allclose(other, 0.8 * one, atol=1e-4)


# ---- mirror images


def mirrored(data):
    for thing in data["objects"]:
        mirror(thing)
    return Scene.from_data(data)


@pytest.mark.parametrize("name", SCENES)
def test_mirrored_objects_are_a_mirror_image(name):
    data = SCENES[name].to_data()
    once = mirrored(data)
    for thing, origin in zip(once.objects, SCENES[name].objects, strict=True):
        one, other = image(thing.shape), image(origin.shape)[:, ::-1]
        assert (one & other).sum() > 0.97 * (one | other).sum()
    again = mirrored(data)
    for thing, origin in zip(again.objects, SCENES[name].objects, strict=True):
        np.testing.assert_array_equal(image(thing.shape), image(origin.shape))
    assert again.environment == SCENES[name].environment


GLIDE = GATE["kinematics"] | {"velocity": [-0.5, 1.0]}


@pytest.mark.parametrize("thing", [FAN, GATE | {"kinematics": GLIDE}, ROCKER, BELT])
def test_a_mirrored_motion_is_the_mirror_image_of_the_motion(thing):
    data = scene_data(EGG, thing)
    motion = Scene.from_data(data).objects[1].kinematics
    other = mirrored(data).objects[1].kinematics
    assert other != motion
    assert other.fastest(0.2) == motion.fastest(0.2)
    for ((x, y), turn), ((u, v), w) in zip(motion.poses(), other.poses(), strict=True):
        np.testing.assert_allclose([u, v, w], [-x, y, -turn])


def test_a_mirrored_hose_swings_to_the_other_side():
    thing = scene_data(HOSE)["objects"][0]
    time, _, velocity = Hose.model_validate(thing["emission"]).births(0.05, 0.01)
    mirror(thing)
    again, _, other = Hose.model_validate(thing["emission"]).births(0.05, 0.01)
    np.testing.assert_array_equal(again, time)
    np.testing.assert_allclose(other, velocity * [-1, 1])


# ---- colours


def colored(*colors):
    return [{"visualization": {"color": color}} for color in colors]


@given(generators, st.lists(st.sampled_from(list(PALETTE.values())), max_size=5))
def test_a_free_colour_is_vivid_and_of_a_hue_of_its_own(rng, used):
    color = free_color(rng, colored(*used))
    assert color in VIVID
    greys = ("#FFFFFF", "#C8C8C8", "#969696")
    hued = [other for other in used if other not in greys]
    assert all(hue_difference(color, other) > HUE_STEP for other in hued)


def test_without_room_for_another_hue_any_vivid_colour_is_drawn():
    used = colored(*list(PALETTE.values())[:24:2])
    rng = np.random.default_rng(0)
    assert len({free_color(rng, used) for _ in range(40)} & set(VIVID)) > 10


# ---- motions


@many
@given(generators, things)
def test_a_new_motion_leaves_looks_and_matter_as_they_were(rng, thing):
    before = copy.deepcopy(thing)
    kind = set_in_motion(rng, thing)
    changed = {path[:2] for path in changes(before, thing)}
    if before["object_type"] == "dynamic_body":
        assert kind == "throw"
        assert changed == {("initial_state", "velocity")}
    elif before["object_type"] == "emitter":
        assert kind == "aim"
        assert changed <= {("emission", "velocity"), ("shape", "angle_deg")}
    else:
        assert kind == thing["kinematics"]["type"]
        assert thing["object_type"] == "kinematic_collider"
        parts = {path[0] for path in changed}
        belt = {"contact"} if kind == "conveyor" else set()
        assert parts <= {"object_type", "kinematics"} | belt


@many
@given(generators, things.filter(lambda t: not is_matter(t)))
def test_a_collider_moves_as_suits_its_shape_and_not_too_fast(rng, thing):
    kind = set_in_motion(rng, thing)
    shape = thing["shape"]["type"]
    assert kind != "conveyor" or shape in BELTS
    assert kind != "rotate" or shape != "circle"
    if kind == "conveyor":
        assert thing["contact"]["type"] == "slip"
        assert thing["contact"]["friction"] > 0
    corners = np.concatenate(shape_of(thing).local_outline())
    motion = MOTIONS[kind].model_validate(thing["kinematics"])
    reach = float(np.linalg.norm(corners, axis=1).max())
    assert 0.1 < motion.fastest(reach) < 1.25 * TIP_SPEED


@many
@given(generators, things.filter(lambda t: t["object_type"] == "emitter"))
def test_a_nozzle_is_aimed_with_what_leaves_it(rng, thing):
    before = copy.deepcopy(thing)
    set_in_motion(rng, thing)
    one, other = (complex(*t["emission"]["velocity"]) for t in (before, thing))
    turn = thing["shape"]["angle_deg"] - before["shape"]["angle_deg"]
    assert abs(other) == pytest.approx(abs(one), rel=2e-3)
    expected = one * np.exp(1j * math.radians(turn))
    assert abs(other - expected) < 0.02 * abs(one)


# ---- matter


@many
@given(generators, things.filter(is_matter), st.sampled_from(sorted(MATERIALS)))
def test_a_given_material_is_near_the_usual_one_and_no_stiffer(rng, thing, name):
    before = copy.deepcopy(thing)
    if thing["object_type"] == "emitter" and name in NOT_EMITTED:
        with pytest.raises(NoRoomError, match=f"a nozzle cannot release {name}"):
            give_material(rng, thing, name)
        assert thing == before
        return
    give_material(rng, thing, name)
    assert {path[0] for path in changes(before, thing)} <= {"physics_properties"}
    assert material_of(thing) == name
    found, usual = thing["physics_properties"], MATERIALS[name]
    assert found.keys() == usual.keys() | {"constitutive_model"}
    for key, value in usual.items():
        low, high = 1.0, 1.0
        if key in ("density", "yield_stress", "viscosity", "consistency"):
            low, high = 1 / 1.4, 1.4
        if key in ("youngs_modulus", "bulk_modulus"):
            low, high = 0.5, 1.0
        assert low * value - 1e-3 <= found[key] <= high * value * 1.0005 + 1e-3, key


def test_every_material_of_a_scene_can_be_given():
    assert MATERIALS.keys() == MODELS.keys()
    for name in MATERIALS:
        thing = copy.deepcopy(BODY)
        give_material(np.random.default_rng(0), thing, name)
        scene = Scene.from_data(scene_data(thing))
        assert scene.objects[0].physics_properties.constitutive_model == name


# ---- names


def test_renamed_objects_are_copies_with_neutral_names():
    before = [copy.deepcopy(EGG), copy.deepcopy(BOWL)]
    after = renamed(before)
    assert [thing["name"] for thing in after] == ["object_0", "object_1"]
    after[0]["shape"]["center"][0] = 9.0
    assert before == [EGG, BOWL]
