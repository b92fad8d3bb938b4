"""What tests of edits share: scenes to edit, and what an edit has changed."""

import copy

import cv2
import numpy as np
from hypothesis import reject, settings
from hypothesis import strategies as st

from mpmworlds.builder.recipes.objects import NoRoomError
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.scene.scene import Scene
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
from tests.tables import newest_tables

SEEDS = load_seeds()
TABLES = newest_tables()
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
THINGS = [thing for scene in SCENES.values() for thing in scene.to_data()["objects"]]
POOL = [thing for scene in ZOO for thing in scene.to_data()["objects"]]

scenes = st.sampled_from(list(SCENES.values()))
things = st.sampled_from(THINGS).map(copy.deepcopy)
generators = st.integers(0, 2**32 - 1).map(np.random.default_rng)
many = settings(max_examples=30, deadline=None)


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
    """Plain data before and after an edit, and its record; a draw that applies."""
    before = scene.to_data()
    after = copy.deepcopy(before)
    try:
        return before, after, edit(rng, after)
    except NoRoomError:
        reject()


def index_of(scene, name):
    """Number of the object of a name in plain data."""
    return [thing["name"] for thing in scene["objects"]].index(name)


def image(shape):
    """Where a shape is, on a raster of the domain."""
    found = np.zeros((1024, 1024), np.uint8)
    for polygon in shape.outline():
        corners = np.rint(polygon * 1024 * 16 - 8).astype(np.int32)
        cv2.fillPoly(found, [corners], 1, shift=4)
    return found
