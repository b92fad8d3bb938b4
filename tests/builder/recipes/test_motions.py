"""A new motion suits the object and is not too fast."""

import copy
import math

import numpy as np
import pytest
from hypothesis import given

from mpmworlds.builder.recipes.motions import TIP_SPEED, set_in_motion
from mpmworlds.builder.recipes.objects import is_matter
from mpmworlds.sim.scene.objects import MOTIONS, SHAPES
from tests.builder.recipes.edits import (
    TABLES,
    changes,
    generators,
    many,
    things,
)


def shape_of(thing):
    """Shape of an object as a scene holds it."""
    return SHAPES[thing["shape"]["type"]].model_validate(thing["shape"])


@many
@given(generators, things)
def test_a_new_motion_leaves_looks_and_matter_as_they_were(rng, thing):
    before = copy.deepcopy(thing)
    kind = set_in_motion(rng, TABLES, thing)
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
    kind = set_in_motion(rng, TABLES, thing)
    shape = thing["shape"]["type"]
    assert kind != "conveyor" or shape in TABLES.belts
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
    set_in_motion(rng, TABLES, thing)
    one, other = (complex(*t["emission"]["velocity"]) for t in (before, thing))
    turn = thing["shape"]["angle_deg"] - before["shape"]["angle_deg"]
    assert abs(other) == pytest.approx(abs(one), rel=2e-3)
    expected = one * np.exp(1j * math.radians(turn))
    assert abs(other - expected) < 0.02 * abs(one)
