"""An edit does what its record says, and leaves the rest of a scene as it was."""

import copy
from functools import partial

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpmworlds.builder.attempt import MOST_DRAWS, NoCandidateError, first_valid
from mpmworlds.builder.compose import MOST_TAKEN, compose, mirror
from mpmworlds.builder.modify import EDITS, modify
from mpmworlds.builder.perturb import RATIO, SHIFT, TURN, perturb
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.palette import PALETTE
from mpmworlds.sim.physics.emission import hose
from mpmworlds.sim.scene import Scene, SceneError
from tests.sim.scenes import (
    BELT,
    BODY,
    BOWL,
    EGG,
    FAN,
    GATE,
    HOSE,
    RAIN,
    ROCKER,
    scene_data,
)

SEEDS = load_seeds()
ZOO = [
    Scene.from_data(scene_data(*things))
    for things in (
        [EGG, BOWL, BELT, ROCKER, RAIN, HOSE],
        [BODY, BELT, BOWL],
        [EGG, GATE, HOSE],
        [ROCKER, RAIN, FAN],
    )
]
SCENES = SEEDS | {f"zoo {i}": scene for i, scene in enumerate(ZOO)}
seeds = st.sampled_from(list(SCENES.values()))
generators = st.integers(0, 2**32 - 1).map(np.random.default_rng)
many = settings(max_examples=30, deadline=None)
ROUNDING = 0.005  # edited numbers keep four digits


def places(node, path=()):
    """Plain data as a mapping from the paths of its leaves to their values."""
    if isinstance(node, dict | list) and node:
        items = node.items() if isinstance(node, dict) else enumerate(node)
        return {
            k: v for key, value in items for k, v in places(value, (*path, key)).items()
        }
    return {path: node}


def changes(before, after):
    """Paths at which two plain data differ."""
    one, other = places(before), places(after)
    return {path for path in one | other if one.get(path) != other.get(path)}


def edited(edit, rng, scene):
    """Plain data before and after an edit, and its record."""
    before = scene.to_data()
    after = copy.deepcopy(before)
    return before, after, edit(rng, after)


def index_of(scene, name):
    return [thing["name"] for thing in scene["objects"]].index(name)


@many
@given(generators, seeds)
def test_swapping_a_material_changes_that_of_one_object(rng, scene):
    before, after, record = edited(EDITS["swap_material"], rng, scene)
    i = index_of(before, record["object"])
    place = ("objects", i, "physics_properties")
    assert {path[:3] for path in changes(before, after)} == {place}
    models = [
        s["objects"][i]["physics_properties"]["constitutive_model"]
        for s in (before, after)
    ]
    assert models == [record["from"], record["to"]]
    assert record["from"] != record["to"]


@many
@given(generators, seeds)
def test_removing_an_object_takes_that_one(rng, scene):
    before, after, record = edited(EDITS["remove_object"], rng, scene)
    before["objects"].pop(index_of(before, record["object"]))
    assert after == before


@many
@given(generators, seeds)
def test_changing_gravity_makes_it_weaker_and_oblique(rng, scene):
    before, after, record = edited(EDITS["change_gravity"], rng, scene)
    assert {path[:2] for path in changes(before, after)} == {("environment", "gravity")}
    assert after["environment"]["gravity"] == record["to"]
    assert before["environment"]["gravity"] == record["from"]
    assert 2.9 < np.hypot(*record["to"]) < 9.9
    assert record["to"][1] < 0


@many
@given(generators, seeds)
def test_changing_contact_sets_one_law_everywhere(rng, scene):
    before, after, record = edited(EDITS["change_contact"], rng, scene)
    assert all(
        path[-2:] in {("contact", "type"), ("walls", "contact")}
        for path in changes(before, after)
    )
    laws = {o["contact"]["type"] for o in after["objects"] if "contact" in o}
    assert laws | {after["environment"]["walls"]["contact"]} == {record["to"]}
    assert before["environment"]["walls"]["contact"] == record["from"] != record["to"]


@many
@given(generators, seeds)
def test_resizing_scales_the_shape_of_one_object(rng, scene):
    before, after, record = edited(EDITS["resize_object"], rng, scene)
    i, factor = index_of(before, record["object"]), record["factor"]
    changed = changes(before, after)
    assert {path[:3] for path in changed} == {("objects", i, "shape")}
    one, other = places(before), places(after)
    for path in changed:
        assert other[path] == pytest.approx(one[path] * factor, rel=5e-4, abs=1e-4)
    assert abs(factor - 1) > 0.2


@many
@given(generators, seeds)
def test_a_modification_is_one_of_the_edits_and_says_which(rng, scene):
    before, after, record = edited(modify, rng, scene)
    assert record["operator"] in EDITS
    assert before != after


@many
@given(generators, seeds)
def test_perturbing_keeps_structure_and_stays_within_its_bounds(rng, scene):
    before, after, record = edited(perturb, rng, scene)
    assert record.keys() == {"operator", "jittered"}
    assert record["operator"] == "perturb"
    one, other = places(before), places(after)
    assert one.keys() == other.keys()
    changed = changes(before, after)
    assert ("simulation", "seed") in changed
    for path in changed - {("simulation", "seed")}:
        a, b = one[path], other[path]
        assert path[0] == "objects"
        assert isinstance(a, float), path
        if "center" in path:
            assert abs(b - a) <= SHIFT + 1e-4
        elif path[-1] == "angle_deg":
            assert abs(b - a) <= TURN + ROUNDING
        else:
            low, high = sorted((a / RATIO, a * RATIO))
            assert (
                low - ROUNDING * abs(a) - 1e-4 <= b <= high + ROUNDING * abs(a) + 1e-4
            )
    moved = {before["objects"][path[1]]["name"] for path in changed if len(path) > 2}
    assert moved == set(record["jittered"])
    centers = {path[1] for path in changed if "center" in path}
    assert len(centers) == len(moved)
    Scene.from_data(after)


@settings(max_examples=10, deadline=None)
@given(generators, seeds, seeds)
def test_composing_adds_what_the_record_says_in_a_colour_of_its_own(rng, scene, other):
    edit = partial(compose, other=other.to_data())
    result, record = first_valid(partial(edit, rng), scene.to_data(), lambda s: s, "x")
    named = {thing.name: thing for thing in other.objects}
    kept, added = (
        result.objects[: len(scene.objects)],
        result.objects[len(scene.objects) :],
    )
    assert 1 <= len(added) == len(record["taken"]) <= MOST_TAKEN
    for thing, name in zip(added, record["taken"], strict=True):
        assert type(thing) is type(named[name])
        assert type(thing.shape) is type(named[name].shape)
    for thing, origin in zip(kept, scene.objects, strict=True):
        assert thing.visualization == origin.visualization
    colors = [thing.visualization.color for thing in added]
    used = {thing.visualization.color for thing in kept}
    assert len(used | set(colors)) == len(used) + len(added)
    assert [t.name for t in result.objects] == [
        f"object_{i}" for i in range(len(result.objects))
    ]


def test_composing_does_not_change_the_other_scene():
    scene, other = (SEEDS[name].to_data() for name in list(SEEDS)[:2])
    before = copy.deepcopy(other)
    compose(np.random.default_rng(0), scene, other=other)
    assert other == before


def test_a_scene_without_room_for_a_hue_is_no_valid_draw():
    scene = next(iter(SEEDS.values())).to_data()
    body = scene["objects"][0]
    hues = list(PALETTE.values())[:24:2]
    scene["objects"] = [
        copy.deepcopy(body) | {"visualization": {"color": c}} for c in hues
    ]
    compose(np.random.default_rng(0), scene, other=scene)
    with pytest.raises(SceneError, match="is too near to"):
        Scene.from_data(scene)


def image(shape):
    """Where a shape is, on a raster of the domain."""
    found = np.zeros((1024, 1024), np.uint8)
    for polygon in shape.outline():
        cv2.fillPoly(
            found, [np.rint(polygon * 1024 * 16 - 8).astype(np.int32)], 1, shift=4
        )
    return found


@pytest.mark.parametrize("name", SCENES)
def test_a_mirrored_scene_is_its_own_mirror_image(name):
    data = SCENES[name].to_data()
    mirror(data)
    mirrored = Scene.from_data(data)
    for thing, origin in zip(mirrored.objects, SCENES[name].objects, strict=True):
        one, other = image(thing.shape), image(origin.shape)[:, ::-1]
        assert (one & other).sum() > 0.97 * (one | other).sum()
    mirror(data)
    again = Scene.from_data(data)
    for thing, origin in zip(again.objects, SCENES[name].objects, strict=True):
        np.testing.assert_array_equal(image(thing.shape), image(origin.shape))
    assert again.environment == SCENES[name].environment


GLIDE = GATE["kinematics"] | {"velocity": [-0.5, 1.0]}


@pytest.mark.parametrize("thing", [FAN, GATE | {"kinematics": GLIDE}, ROCKER, BELT])
def test_a_mirrored_motion_is_the_mirror_image_of_the_motion(thing):
    data = scene_data(EGG, thing)
    motion = Scene.from_data(data).objects[1].kinematics
    mirror(data)
    mirrored = Scene.from_data(data).objects[1].kinematics
    assert mirrored != motion
    assert mirrored.fastest(0.2) == motion.fastest(0.2)
    for ((x, y), turn), ((u, v), w) in zip(
        motion.poses(), mirrored.poses(), strict=True
    ):
        np.testing.assert_allclose([u, v, w], [-x, y, -turn])


def test_a_mirrored_hose_swings_to_the_other_side():
    data = scene_data(HOSE)
    time, _, velocity = hose(data["objects"][0]["emission"], 0.05, 0.01)
    mirror(data)
    again, _, mirrored = hose(data["objects"][0]["emission"], 0.05, 0.01)
    np.testing.assert_array_equal(again, time)
    np.testing.assert_allclose(mirrored, velocity * [-1, 1])


def test_perturbing_reaches_every_length_and_speed_in_some_draw():
    kept = {"phase_deg", "start", "stop", "rate"}
    start = places(ZOO[0].to_data())
    numbers = {
        path
        for path, value in start.items()
        if {"shape", "kinematics", "emission"} & set(path)
        and not kept & set(path)
        and isinstance(value, float)
    }
    changed = set()
    for seed in range(12):
        rng = np.random.default_rng(seed)
        changed |= changes(*edited(perturb, rng, ZOO[0])[:2])
    assert numbers - changed == set()


def test_candidates_are_drawn_afresh_until_one_is_valid():
    start = next(iter(SEEDS.values())).to_data()
    seen = []

    def draw(data):
        seen.append(data["simulation"]["seed"])
        data["simulation"]["seed"] = len(seen) - 3
        return len(seen)

    scene, record = first_valid(draw, start, lambda s: s, "p0001")
    assert (scene.simulation.seed, record) == (0, 3)
    assert seen == 3 * [start["simulation"]["seed"]]


def test_a_scene_that_leaves_no_room_names_the_sample_and_the_last_fault():
    def draw(data):
        data["simulation"]["seed"] = -1

    start = next(iter(SEEDS.values())).to_data()
    with pytest.raises(NoCandidateError) as error:
        first_valid(draw, start, lambda s: s, "p0123-c4")
    for part in ("p0123-c4: ", str(MOST_DRAWS), "simulation.seed = -1, must be >= 0"):
        assert part in str(error.value)
