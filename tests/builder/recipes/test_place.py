"""An object gets a place where a scene has room, and none where it has none."""

import copy

import numpy as np
import pytest

from mpmworlds.builder.recipes.objects import NoRoomError
from mpmworlds.builder.recipes.place import HIGHEST, LOWEST, place
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, EGG, OBSTACLE, scene_data

PEG = OBSTACLE | {"shape": {"type": "circle", "center": [0.75, 0.5], "radius": 0.03}}
DROP = BODY | {
    "name": "drop",
    "shape": {"type": "circle", "center": [0.0, 0.0], "radius": 0.05},
    "visualization": {"color": "#2C90F5"},
}
BLOCK = BODY | {"shape": {"type": "box", "center": [0.5, 0.5], "size": [0.78, 0.78]}}


def placed(seed, thing, *others):
    """Center that an object gets in a scene of others."""
    scene = scene_data(*others)
    place(np.random.default_rng(seed), scene, copy.deepcopy(thing))
    return scene["objects"][-1]["shape"]["center"]


def test_a_placed_object_makes_a_valid_scene_and_moves_no_other():
    for seed in range(8):
        scene = scene_data(EGG, PEG)
        before = copy.deepcopy(scene)
        place(np.random.default_rng(seed), scene, copy.deepcopy(DROP))
        center = scene["objects"][-1]["shape"]["center"]
        assert all(LOWEST <= x <= HIGHEST for x in center)
        added = DROP | {"shape": DROP["shape"] | {"center": center}}
        assert scene == before | {"objects": [*before["objects"], added]}
        Scene.from_data(scene)


def test_places_follow_from_the_generator_alone():
    assert placed(5, DROP, EGG) == placed(5, DROP, EGG) != placed(6, DROP, EGG)


def test_matter_tends_to_be_put_above_others_and_colliders_below():
    peg = PEG | {"name": "peg"}
    above = [placed(seed, DROP, EGG, PEG)[1] > 0.5 for seed in range(25)]
    below = [
        placed(seed, peg, EGG)[1] < EGG["shape"]["center"][1] for seed in range(25)
    ]
    assert sum(above) > 15
    assert sum(below) > 15


def test_where_there_is_no_room_the_error_says_for_what_and_why():
    scene = scene_data(BLOCK)
    before = copy.deepcopy(scene)
    with pytest.raises(NoRoomError, match=r"no room for drop \(.*drop.*\)"):
        place(np.random.default_rng(0), scene, copy.deepcopy(DROP))
    assert scene == before
