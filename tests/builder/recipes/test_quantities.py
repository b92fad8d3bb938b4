"""Sizes and mirror images of single objects; every number has a kind."""

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.recipes.objects import rounded
from mpmworlds.builder.recipes.quantities import mirror, quantities, scale
from mpmworlds.sim.program.features.emissions.hose import Hose
from mpmworlds.sim.scene.objects import SHAPES
from mpmworlds.sim.scene.scene import Scene
from tests.builder.recipes.edits import (
    SCENES,
    image,
    many,
    places,
    things,
)
from tests.sim.scenes import BELT, BODY, EGG, FAN, GATE, HOSE, ROCKER, scene_data

LENGTHS = {"radius", "size", "semi_axes", "corner_radius", "length", "blade_length"}


def shape_of(thing):
    """Shape of an object as a scene holds it."""
    return SHAPES[thing["shape"]["type"]].model_validate(thing["shape"])


@given(things)
def test_every_number_of_an_object_is_a_quantity(thing):
    found = {id(q.part): set() for q in quantities(thing)}
    for quantity in quantities(thing):
        found[id(quantity.part)].add(quantity.key)
    numbers = {path for path, value in places(thing).items() if is_number(value)}
    for path in numbers:
        part, keys = thing, [key for key in path if isinstance(key, str)]
        for key in keys[:-1]:
            part = part[key]
        assert keys[-1] in found[id(part)], path


def is_number(value):
    return isinstance(value, int | float)


@many
@given(things, st.floats(0.5, 1.7).map(rounded))
def test_scaling_scales_lengths_and_what_a_nozzle_lets_through(thing, factor):
    before = copy.deepcopy(thing)
    scale(thing, factor)
    one, other = places(before), places(thing)
    assert one.keys() == other.keys()
    for path, value in one.items():
        scaled = (
            LENGTHS | {"vertices"} if path[0] == "shape" else {"rate", "drop_radius"}
        )
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
