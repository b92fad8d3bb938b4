"""A given material has values about the typical ones."""

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.recipes.materials import give_material
from mpmworlds.builder.recipes.objects import NoRoomError, is_matter, material_of
from mpmworlds.sim.scene.fields import kind_of
from mpmworlds.sim.scene.objects import MATERIALS, RELEASED
from mpmworlds.sim.scene.scene import Scene
from tests.builder.recipes.edits import (
    TABLES,
    changes,
    generators,
    many,
    things,
)
from tests.sim.scenes import BODY, scene_data


@many
@given(generators, things.filter(is_matter), st.sampled_from(sorted(TABLES.typical)))
def test_a_given_material_is_near_the_usual_one_and_no_stiffer(rng, thing, name):
    before = copy.deepcopy(thing)
    if thing["object_type"] == "emitter" and name not in RELEASED:
        with pytest.raises(NoRoomError, match=f"a nozzle cannot release {name}"):
            give_material(rng, TABLES, thing, name)
        assert thing == before
        return
    give_material(rng, TABLES, thing, name)
    assert {path[0] for path in changes(before, thing)} <= {"physics_properties"}
    assert material_of(thing) == name
    found, usual = thing["physics_properties"], TABLES.typical[name]
    assert found.keys() == usual.keys() | {"constitutive_model"}
    for key, value in usual.items():
        spread = TABLES.spread.get(kind_of(MATERIALS[name], key), (1.0, 1.0))
        low, high = spread[0] * 0.9995, spread[1]
        assert low * value - 1e-3 <= found[key] <= high * value * 1.0005 + 1e-3, key


def test_every_material_of_a_scene_can_be_given():
    assert TABLES.typical.keys() == MATERIALS.keys()
    for name in MATERIALS:
        thing = copy.deepcopy(BODY)
        give_material(np.random.default_rng(0), TABLES, thing, name)
        scene = Scene.from_data(scene_data(thing))
        assert scene.objects[0].physics_properties.constitutive_model == name
