"""An edit does what its record says, and leaves the rest of a scene as it was."""

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.recipes.colors import LEAST_HUE_STEP
from mpmworlds.builder.recipes.modify import EDITS, Means, modify
from mpmworlds.builder.recipes.objects import NoRoomError, is_matter, renamed
from mpmworlds.sim.scene.fields import polygon_area
from mpmworlds.sim.scene.objects import RELEASED, SHAPES
from mpmworlds.sim.scene.palette import PALETTE, hue_difference, saturation
from mpmworlds.sim.scene.scene import Scene, SceneError
from tests.builder.recipes.edits import (
    POOL,
    SCENES,
    SEEDS,
    TABLES,
    changes,
    edited,
    generators,
    index_of,
    many,
    places,
    scenes,
)
from tests.sim.scenes import BODY, scene_data

nozzled = st.sampled_from(
    [s for s in SCENES.values() if any(o.object_type == "emitter" for o in s.objects)]
)


def made(edit, rng, scene):
    """Plain data before and after an edit, and its record."""
    return edited(lambda rng, data: edit(Means(rng, TABLES, POOL), data), rng, scene)


def model(thing):
    return thing["physics_properties"]["constitutive_model"]


def area(shape):
    """Area of a shape [m^2]."""
    outline = SHAPES[shape["type"]].model_validate(shape).local_outline()
    return sum(map(polygon_area, outline))


def drop(i):
    """One of twelve bodies in a grid, each of another hue."""
    return BODY | {
        "name": f"object_{i}",
        "shape": {
            "type": "circle",
            "center": [0.2 + 0.2 * (i % 4), 0.2 + 0.2 * (i // 4)],
            "radius": 0.05,
        },
        "visualization": {"color": list(PALETTE.values())[2 * i]},
    }


@many
@given(generators, scenes)
def test_adding_an_object_leaves_the_others_as_they_were(rng, scene):
    before, after, record = made(EDITS["add_object"], rng, scene)
    added = after["objects"][-1]
    assert after | {"objects": after["objects"][:-1]} == before
    told = {"object": added["name"], "object_type": added["object_type"]}
    if is_matter(added):
        told["material"] = added["physics_properties"]["constitutive_model"]
    assert record == told | {"shape": added["shape"]["type"]}
    assert added["shape"]["type"] in {thing["shape"]["type"] for thing in POOL}
    color = added["visualization"]["color"]
    for other in (thing["visualization"]["color"] for thing in before["objects"]):
        assert saturation(other) <= 0.2 or hue_difference(color, other) > LEAST_HUE_STEP
    if is_matter(added):
        known = [*before["objects"], *POOL]
        assert model(added) in {model(thing) for thing in known if is_matter(thing)}
    Scene.from_data(after)


def test_a_colour_too_near_to_another_leaves_no_room():
    scene = scene_data(*(drop(i) for i in range(12)))  # every hue is near one of them
    with pytest.raises(NoRoomError, match="no colour is free"):
        EDITS["add_object"](Means(np.random.default_rng(1), TABLES, POOL[:1]), scene)


@many
@given(generators, scenes)
def test_removing_an_object_takes_that_one(rng, scene):
    before, after, record = made(EDITS["remove_object"], rng, scene)
    gone = before["objects"].pop(index_of(before, record["object"]))
    assert record["object_type"] == gone["object_type"]
    before["objects"] = renamed(before["objects"])
    assert after == before


@many
@given(generators, scenes)
def test_swapping_a_material_changes_that_of_one_or_all_that_share_it(rng, scene):
    before, after, record = made(EDITS["swap_material"], rng, scene)
    numbers = [index_of(before, name) for name in record["objects"]]
    assert {path[:3] for path in changes(before, after)} == {
        ("objects", i, "physics_properties") for i in numbers
    }
    assert {model(before["objects"][i]) for i in numbers} == {record["from"]}
    assert {model(after["objects"][i]) for i in numbers} == {record["to"]}
    assert record["from"] != record["to"]
    matter = [thing for thing in before["objects"] if is_matter(thing)]
    same = [thing["name"] for thing in matter if model(thing) == record["from"]]
    assert len(numbers) == 1 or record["objects"] == same
    if any(after["objects"][i]["object_type"] == "emitter" for i in numbers):
        assert record["to"] in RELEASED


@many
@given(generators, scenes)
def test_resizing_scales_the_shape_of_one_object(rng, scene):
    before, after, record = made(EDITS["resize_object"], rng, scene)
    i, factor = index_of(before, record["object"]), record["factor"]
    changed = changes(before, after)
    emission = {("objects", i, "emission", key) for key in ("rate", "drop_radius")}
    assert ("objects", i, "shape") in {path[:3] for path in changed}
    assert {path[:3] for path in changed - emission} == {("objects", i, "shape")}
    one, other = places(before), places(after)
    for path in changed:
        assert other[path] == pytest.approx(one[path] * factor, rel=5e-4, abs=1e-4)
    assert abs(factor - 1) > 0.2


@many
@given(generators, scenes)
def test_reshaping_keeps_the_place_and_about_the_area_of_one_object(rng, scene):
    before, after, record = made(EDITS["reshape_object"], rng, scene)
    i = index_of(before, record["object"])
    assert {path[:3] for path in changes(before, after)} == {("objects", i, "shape")}
    one, other = (data["objects"][i]["shape"] for data in (before, after))
    assert (one["type"], other["type"]) == (record["from"], record["to"])
    assert one["type"] != other["type"]
    assert one["center"] == other["center"]
    flat = 0.5 if one["type"] == "capsule" else 0.75  # its round ends do not count
    assert flat < area(other) / area(one) < 1.25
    assert before["objects"][i]["object_type"] != "emitter"


@many
@given(generators, scenes)
def test_changing_a_motion_changes_that_of_one_object(rng, scene):
    before, after, record = made(EDITS["change_motion"], rng, scene)
    i = index_of(before, record["object"])
    assert {path[:2] for path in changes(before, after)} == {("objects", i)}
    one, other = before["objects"][i], after["objects"][i]
    assert one.get("kinematics", {"type": "none"})["type"] == record["from"]
    if is_matter(other):
        assert record["to"] in ("throw", "aim")
    else:
        assert other["kinematics"]["type"] == record["to"]
    assert one["visualization"] == other["visualization"]


@many
@given(generators, scenes)
def test_changing_contact_sets_one_law_everywhere_but_on_belts(rng, scene):
    before, after, record = made(EDITS["change_contact"], rng, scene)
    assert all(
        path[-2:] in {("contact", "type"), ("walls", "contact")}
        for path in changes(before, after)
    )
    belts = [
        i
        for i, thing in enumerate(before["objects"])
        if thing.get("kinematics", {}).get("type") == "conveyor"
    ]
    laws = {after["environment"]["walls"]["contact"]}
    for i, thing in enumerate(after["objects"]):
        if i in belts:
            assert thing == before["objects"][i]
        elif "contact" in thing:
            laws.add(thing["contact"]["type"])
    assert laws == {record["to"]}
    assert before["environment"]["walls"]["contact"] == record["from"] != record["to"]


@many
@given(generators, nozzled)
def test_changing_emission_changes_speed_and_time_of_one_nozzle(rng, scene):
    before, after, record = made(EDITS["change_emission"], rng, scene)
    i = index_of(before, record["object"])
    assert {path[:3] for path in changes(before, after)} == {("objects", i, "emission")}
    one, other = (data["objects"][i]["emission"] for data in (before, after))
    expected = one | {
        "velocity": [v * record["factor"] for v in one["velocity"]],
        "rate": one["rate"] * record["factor"],
        "start": one["start"] + record["delay"],
        "stop": one["stop"] + record["delay"],
    }
    assert other.keys() == expected.keys()
    for key, value in expected.items():
        near = (
            value
            if isinstance(value, str)
            else pytest.approx(value, rel=1e-3, abs=1e-3)
        )
        assert other[key] == near
    assert not 0.8 < record["factor"] < 1.25


def test_a_scene_without_a_nozzle_has_no_emission_to_change():
    scene = SEEDS["s04_bouncing_blocks"].to_data()
    with pytest.raises(NoRoomError, match="no nozzle"):
        EDITS["change_emission"](Means(np.random.default_rng(0), TABLES, POOL), scene)


@many
@given(generators, scenes)
def test_changing_gravity_makes_it_weaker_and_oblique(rng, scene):
    before, after, record = made(EDITS["change_gravity"], rng, scene)
    assert {path[:2] for path in changes(before, after)} == {("environment", "gravity")}
    assert after["environment"]["gravity"] == record["to"]
    assert before["environment"]["gravity"] == record["from"]
    assert 2.9 < np.hypot(*record["to"]) < 9.9
    assert record["to"][1] < 0


@many
@given(generators, scenes)
def test_a_modification_is_one_of_the_edits_and_says_which(rng, scene):
    before, after, record = edited(
        lambda rng, data: modify(rng, TABLES, data, POOL), rng, scene
    )
    assert record["operator"] in EDITS
    assert before != after


def test_edits_are_drawn_by_their_shares(monkeypatch):
    assert TABLES.edits.keys() == EDITS.keys()
    assert sum(TABLES.edits.values()) == pytest.approx(1.0)
    for name in EDITS:
        monkeypatch.setitem(EDITS, name, lambda means, scene: {})
    rng = np.random.default_rng(0)
    drawn = [modify(rng, TABLES, {}, [])["operator"] for _ in range(4000)]
    for name, share in TABLES.edits.items():
        assert drawn.count(name) / len(drawn) == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("name", EDITS)
def test_every_edit_leads_to_a_valid_scene_in_some_draw(name):
    origin = SEEDS["s07_fountain_basin"].to_data()
    pool = copy.deepcopy(POOL)
    for seed in range(40):
        data = copy.deepcopy(origin)
        try:
            EDITS[name](Means(np.random.default_rng(seed), TABLES, pool), data)
            Scene.from_data(data)
        except (NoRoomError, SceneError):
            continue
        break
    else:
        pytest.fail("no draw is a valid scene")
    assert pool == POOL
