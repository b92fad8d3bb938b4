"""A trial shows what a scene does, and a scene that shows nothing is rejected."""

import copy
import dataclasses
import math
import re

import numpy as np
import pytest

from mpmworlds.builder.plan.screen import (
    ATTEMPTS,
    LEAST_MATTER,
    Findings,
    fastest_explained,
    fault,
    findings,
    in_doubt,
    measured,
    try_out,
)
from mpmworlds.sim.run.run import Outcome
from mpmworlds.sim.run.states import States
from mpmworlds.sim.run.track import Track
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, FAN, JET, LIQUID, OBSTACLE, SAND, scene_data

PASSES = Findings(
    "ok",
    matter=LEAST_MATTER,
    lost=0,
    travel=0.02,
    later=0.004,
    motion=0.05,
    speed=1.0,
    depth=1.0,
    inverted=0.01,
    crowded=0.05,
)
PEG = OBSTACLE | {"shape": {"type": "box", "center": [0.5, 0.25], "size": [0.5, 0.5]}}
FRAMES = 121  # four seconds and the first frame
BLACK = np.zeros((FRAMES, 2, 2, 3), np.uint8)


# ---- the verdict


def test_a_trial_at_every_bound_passes():
    assert fault(PASSES) is None


@pytest.mark.parametrize(
    ("finding", "reason"),
    [
        ({"status": "timeout"}, "timeout"),
        ({"lost": 1}, "not_finite_or_outside"),
        ({"matter": LEAST_MATTER - 1}, "blank"),
        ({"speed": 1.001}, "exploding"),
        ({"speed": math.nan}, "exploding"),
        ({"depth": 1.001}, "tunnels"),
        ({"travel": 0.0199}, "static"),
        ({"later": 0.0039}, "at_rest_after_prefix"),
        ({"motion": 0.0499}, "hardly_moves"),
        ({"inverted": 0.0101}, "inverted"),
        ({"crowded": 0.0501}, "crowded"),
    ],
)
def test_each_rule_has_its_reason(finding, reason):
    assert fault(dataclasses.replace(PASSES, **finding)) == reason


def test_a_run_that_failed_is_named_by_its_failure_whatever_else_it_showed():
    assert fault(dataclasses.replace(PASSES, status="crash", lost=9)) == "crash"


# ---- what is measured


def states_of(positions, velocities=None, poses=None, solid_mass=()):
    """States of particles at (T, N, 2) and solids at (T, K, 3)."""
    x = np.asarray(positions, np.float32)
    T, N = x.shape[:2]
    K = len(solid_mass)
    return States(
        time=np.arange(T) / 30.0,
        object_id=np.zeros(N, np.int16),
        mass=np.ones(N, np.float32),
        positions=x,
        velocities=np.where(np.isnan(x), x, 0.0) if velocities is None else velocities,
        poses=np.zeros((T, K, 3)) if poses is None else poses,
        rates=np.zeros((T, K, 3)),
        solid_id=np.full(K, 1, np.int16),
        solid_mass=np.asarray(solid_mass, np.float64),
        solid_inertia=np.asarray(solid_mass, np.float64),
        gravity=np.array([0.0, -9.8]),
    )


def found(states, *things):
    scene = Scene.from_data(scene_data(*(things or (BODY,))))
    return measured(scene, states)


def still(count=20):
    """Particles at rest in a row."""
    x = np.full((FRAMES, count, 2), 0.75)
    x[:, :, 0] -= np.arange(count) / 200
    return x


def test_a_run_without_states_shows_only_how_it_ended():
    scene = Scene.from_data(scene_data())
    for status in ("crash", "no_states"):
        assert findings(scene, Outcome(status, BLACK, 1.0, "")) == Findings(status, 32)


def test_matter_at_rest_shows_nothing_but_itself():
    assert found(states_of(still())) == Findings("ok", 32, matter=20)


def test_matter_counts_at_the_end_of_the_prefix():
    x = still()
    x[:75, 4:10] = np.nan  # born at 2.5 s, and after it
    x[:76, 10:] = np.nan
    assert found(states_of(x)).matter == 10


def test_a_rigid_body_counts_as_enough_matter():
    x = np.zeros((FRAMES, 0, 2))
    poses = np.zeros((FRAMES, 1, 3))
    poses[:, 0, 0] = np.linspace(0.2, 0.4, FRAMES)
    body = found(states_of(x, poses=poses, solid_mass=[3.0]), BODY, OBSTACLE)
    assert body.matter == LEAST_MATTER
    assert body.travel == pytest.approx(0.2 * 75 / 120, rel=1e-3)
    assert body.later == pytest.approx(0.2 * 15 / 120, rel=1e-3)
    collider = found(states_of(x, poses=poses, solid_mass=[math.inf]), BODY, OBSTACLE)
    assert (collider.matter, collider.travel, collider.later) == (0, 0.0, 0.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.01, 1.01])
def test_a_particle_that_is_once_not_finite_or_outside_is_lost(value):
    x = still()
    x[40, 7, 1] = value
    if np.isnan(value):
        x[40, 7] = np.nan  # as a whole, after its birth
    assert found(states_of(x)).lost == 1


def test_a_particle_whose_velocity_is_not_finite_is_lost():
    states = states_of(still())
    states.velocities[40:, 7] = np.nan
    shown = found(states)
    assert fault(shown) == "not_finite_or_outside"


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.01, 1.01])
def test_a_rigid_body_that_is_once_not_finite_or_outside_is_lost(value):
    poses = np.full((FRAMES, 2, 3), 0.5)
    poses[40, :, 1] = value
    states = states_of(still(), poses=poses, solid_mass=[3.0, math.inf])
    lost = dataclasses.replace(states, solid_id=np.array([1, 1], np.int16))
    shown = found(lost, BODY, OBSTACLE)
    assert (shown.lost, fault(shown)) == (1, "not_finite_or_outside")


class Fails:
    """A warm start whose programs end in one way so many times, then well."""

    def __init__(self, status, times):
        self.statuses = [status] * times
        x = states_of(still())
        self.track = Track(
            time=x.time,
            owner=x.object_id,
            mass=x.mass,
            positions=x.positions,
            velocities=x.velocities,
            poses=x.poses,
            rates=x.rates,
        )

    def run(self, program, frames, timeout, *, pictures):
        status = self.statuses.pop() if self.statuses else "ok"
        return Outcome(status, BLACK, 1.0, "", self.track if status == "ok" else None)


@pytest.mark.parametrize("status", ["crash", "timeout"])
def test_trouble_of_the_machine_is_not_taken_for_one_of_the_scene(status):
    scene = Scene.from_data(scene_data(BODY))
    assert try_out(scene, Fails(status, ATTEMPTS - 1)).status == "ok"


def test_a_program_that_always_crashes_is_at_fault_but_one_that_is_slow_is_not():
    scene = Scene.from_data(scene_data(BODY))
    assert try_out(scene, Fails("crash", ATTEMPTS)) == Findings("crash", 32)
    with pytest.raises(RuntimeError, match=r"within 120 s, 3 times; run the command"):
        try_out(scene, Fails("timeout", ATTEMPTS))


def test_travel_is_what_a_tenth_of_the_matter_exceeds():
    x = still(100)
    x[75:, :20, 0] -= 0.1  # a fifth of it, by the end of the prefix
    x[80:, :5, 0] -= 0.3  # a twentieth, after it
    shown = found(states_of(x))
    assert shown.travel == pytest.approx(0.1, rel=1e-3)
    assert shown.later == 0.0


def test_travel_of_matter_that_is_born_counts_from_its_birth():
    x = still()
    x[:60] = np.nan
    x[60:, :, 0] = 0.3 + 0.01 * np.arange(FRAMES - 60)[:, None]
    shown = found(states_of(x))
    assert shown.travel == pytest.approx(0.15, rel=1e-3)
    assert shown.later == pytest.approx(0.15, rel=1e-3)


def test_speed_is_a_part_of_what_all_causes_of_motion_explain():
    scene = Scene.from_data(scene_data(BODY))
    fastest = fastest_explained(scene)
    assert fastest == pytest.approx(1.5 * math.sqrt(2 * 9.8))
    v = np.zeros((FRAMES, 20, 2), np.float32)
    v[30, 3] = [0.6 * fastest, -0.8 * fastest]
    assert found(states_of(still(), v)).speed == pytest.approx(1.0, rel=1e-3)


def test_liquids_that_fill_corners_explain_twice_the_speed():
    wet, dry = (
        fastest_explained(Scene.from_data(scene_data(BODY | {"physics_properties": m})))
        for m in (LIQUID, SAND)
    )
    assert wet == 2.0 * dry


def test_what_is_driven_or_sprayed_explains_more_speed():
    still_, driven = (
        fastest_explained(Scene.from_data(scene_data(BODY, *things)))
        for things in ((OBSTACLE,), (OBSTACLE, FAN, JET | {"physics_properties": SAND}))
    )
    assert driven - still_ == pytest.approx(1.5 * (1.5 + 4.0 * 0.15), rel=0.1)


def test_depth_is_that_in_a_solid_wherever_it_is():
    x = still()
    x[30, 0] = [0.5, 0.46]  # 0.04 m below the top
    poses = np.zeros((FRAMES, 1, 3))
    poses[:, 0, :2] = PEG["shape"]["center"]
    states = states_of(x, poses=poses, solid_mass=[math.inf])
    assert found(states, BODY, PEG).depth == pytest.approx(0.04 * 32, abs=0.1)
    poses[:, 0, 1] -= 0.05
    states = states_of(x, poses=poses, solid_mass=[math.inf])
    assert found(states, BODY, PEG).depth == 0.0


# ---- real trials


@pytest.fixture(scope="module")
def warm():
    with WarmStart() as warm:
        yield warm


class Counts:
    """A warm start that counts the cells of the programs it is given."""

    def __init__(self):
        self.cells, self.track = [], Fails("ok", 0).track

    def run(self, program, frames, timeout, *, pictures):
        self.cells.append(int(re.search(r"GRID.* = (\d+)", program)[1]))
        return Outcome("ok", BLACK, 1.0, "", self.track)


def fine(*things, **shape):
    """A scene of 128 cells, whose first object is of a shape if one is given."""
    data = scene_data(*things)
    data["simulation"] |= {"grid_resolution": 128, "time_step_dt": 1e-4}
    data["objects"][0] = data["objects"][0] | ({"shape": shape} if shape else {})
    return Scene.from_data(data)


def test_a_scene_without_enough_particles_for_a_small_trial_is_tried_at_full_size():
    speck = {"type": "circle", "center": [0.5, 0.5], "radius": 0.012}
    warm = Counts()
    assert try_out(fine(BODY, **speck), warm).cells == 128
    assert warm.cells == [128]


def test_what_is_at_rest_for_sure_is_tried_once():
    warm = Counts()
    found = try_out(fine(BODY), warm)
    assert (found.cells, warm.cells) == (64, [64])


def test_a_material_that_depends_on_the_grid_is_tried_at_full_size():
    matter = BODY["physics_properties"] | {"constitutive_model": "elastic_fem"}
    warm = Counts()
    assert try_out(fine(BODY | {"physics_properties": matter}), warm).cells == 128
    assert warm.cells == [128]


@pytest.mark.parametrize(
    ("finding", "doubt"),
    [
        ({}, False),
        ({"status": "crash", "later": 0.004}, False),
        ({"later": 0.004 * 1.9}, True),
        ({"later": 0.004 / 1.9}, True),
        ({"later": 0.004 / 2.1}, False),
        ({"motion": 0.09}, True),
        ({"travel": 0.03}, True),
        ({"speed": 0.8}, True),
        ({"speed": 1.6}, False),
        ({"depth": 0.7}, True),
        ({"crowded": 0.03}, True),
    ],
)
def test_a_trial_near_a_limit_is_in_doubt(finding, doubt):
    clear = Findings("ok", 64, matter=99, travel=0.5, later=0.2, motion=0.5)
    found = dataclasses.replace(clear, **finding)
    assert in_doubt(found) is doubt


@pytest.mark.slow
def test_a_falling_body_passes_and_shows_the_same_at_every_trial(warm):
    data = scene_data(BODY | {"initial_state": {"velocity": [2.0, 3.0]}})
    data["environment"]["gravity"] = [0.0, -0.5]
    scene = Scene.from_data(data)
    before = copy.deepcopy(scene)
    shown = try_out(scene, warm)
    assert shown == try_out(scene, warm)
    assert shown.status == "ok"
    assert shown.lost == 0
    assert shown.matter > 100
    assert shown.travel > 0.1
    assert 0.1 < shown.speed < 1.0
    assert scene == before


@pytest.mark.slow
def test_a_body_at_rest_on_the_floor_is_static(warm):
    floor = 3 / 32
    shape = {"type": "box", "center": [0.5, floor + 0.03], "size": [0.4, 0.06]}
    stiff = BODY["physics_properties"] | {"youngs_modulus": 4.0e5, "density": 500.0}
    body = BODY | {"shape": shape, "physics_properties": stiff}
    data = scene_data(body, gravity=(0.0, -3.0))
    data["environment"]["walls"]["thickness_cells"] = 3
    shown = try_out(Scene.from_data(data), warm)
    assert shown.status == "ok"
    assert fault(shown) == "static"
