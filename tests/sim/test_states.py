"""States are those of the scene, obey mechanics, and survive their file."""

import zipfile
from dataclasses import dataclass

import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.run.states import (
    States,
    invariants,
    load_states,
    save_states,
    summary,
)
from mpmworlds.sim.run.track import unwrap
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, FAN, JET, OBSTACLE, scene_data

G = 9.8
DT = 4e-4
FRAME = 25 * DT  # seconds
SPACING = 1 / 64  # of particles
BLOCK = {
    "name": "block",
    "object_type": "dynamic_body",
    "shape": {"type": "box", "center": [0.7, 0.6], "size": [0.12, 0.2]},
    "physics_properties": {"constitutive_model": "rigid", "density": 500.0},
    "initial_state": {"velocity": [0.5, 0.0], "angular_velocity": 60.0},
    "visualization": {"color": "#2C90F5"},
}


@dataclass(frozen=True)
class Mixed:
    """Frames of a run, and its states."""

    frames: np.ndarray
    states: States


def outcome_of(data, states=True):
    outcome = run(link(Scene.from_data(data)), timeout=120, states=states)
    assert outcome.status == "ok", outcome.message
    return outcome


def states_of(data, outcome):
    return States.of(Scene.from_data(data), outcome.states)


@pytest.fixture(scope="module")
def data():
    """A body above an obstacle, beside a fan below a jet, for 0.23 s."""
    return scene_data(BODY, OBSTACLE, FAN, JET, frames=24)


@pytest.fixture(scope="module")
def mixed(data):
    outcome = outcome_of(data)
    return Mixed(outcome.frames, states_of(data, outcome))


@pytest.fixture(scope="module")
def falling():
    """An elastic body and a spinning rigid one fall freely for 0.11 s."""
    data = scene_data(BODY, BLOCK, frames=12)
    return states_of(data, outcome_of(data))


def made(**parts):
    """States at two frames: two particles, a collider and a rigid body."""
    x = np.array([[[1, 2], [np.nan] * 2], [[2, 2], [0, 1]]], np.float32)
    v = np.array([[[3, 4], [np.nan] * 2], [[0, 1], [1, 0]]], np.float32)
    rates = np.array([[9.0, 9.0, 9.0], [0.0, 2.0, 5.0]])
    usual = {
        "time": np.array([0.0, 0.5]),
        "object_id": np.array([0, 3], np.int16),
        "mass": np.array([2.0, 4.0], np.float32),
        "positions": x,
        "velocities": v,
        "poses": np.array([[[7.0, 7.0, 7.0], [3.0, 1.0, 0.0]]] * 2),
        "rates": np.array([rates, rates]),
        "solid_id": np.array([1, 2], np.int16),
        "solid_mass": np.array([np.inf, 10.0]),
        "solid_inertia": np.array([np.inf, 0.5]),
        "gravity": np.array([1.0, -2.0]),
    }
    return States(**usual | parts)


def test_shapes_are_those_of_frames_particles_and_solids(mixed):
    states = mixed.states
    T, N, K = len(mixed.frames), len(states.object_id), 2
    assert (T, states.solid_id.tolist()) == (24, [1, 2])
    assert states.positions.shape == states.velocities.shape == (T, N, 2)
    assert states.poses.shape == states.rates.shape == (T, K, 3)
    assert states.mass.shape == (N,)
    assert states.solid_mass.shape == states.solid_inertia.shape == (K,)
    np.testing.assert_allclose(states.time, FRAME * np.arange(T), rtol=1e-12)
    np.testing.assert_array_equal(states.gravity, [0.0, -G])


def test_particles_are_nan_until_the_emitter_releases_them(mixed):
    states = mixed.states
    known = ~np.isnan(np.concatenate([states.positions, states.velocities], axis=-1))
    assert (known == states.born[..., None]).all()
    assert states.born[:, states.object_id == 0].all(), "a body is there from the start"
    emitted = states.born[:, states.object_id == 3].sum(axis=1)
    expected = JET["emission"]["rate"] * np.minimum(states.time, 0.2)
    np.testing.assert_allclose(emitted, expected, atol=2)
    assert emitted[0] <= 2 < 78 <= emitted[-1]
    assert (np.diff(states.born.astype(int), axis=0) >= 0).all()


def test_particles_belong_to_the_bodies_and_emitters_and_weigh_as_they_do(mixed):
    states = mixed.states
    assert set(states.object_id.tolist()) == {0, 3}
    mass = states.mass[states.object_id == 0].sum()
    assert mass == pytest.approx(1000.0 * 0.2 * 0.16, rel=0.06)
    np.testing.assert_allclose(states.mass, 1000.0 * SPACING**2, rtol=1e-6)
    assert np.isinf([states.solid_mass, states.solid_inertia]).all()


def test_where_all_is_rigid_there_is_no_particle(tmp_path):
    data = scene_data(BLOCK, frames=2)
    states = states_of(data, outcome_of(data))
    assert states.positions.shape == states.velocities.shape == (2, 0, 2)
    assert len(states.mass) == len(states.object_id) == 0
    found = invariants(states, states.gravity)
    assert all(np.isfinite(values).all() for values in found.values())
    save_states(tmp_path / "states.npz", states)
    assert load_states(tmp_path / "states.npz").positions.shape == (2, 0, 2)


def test_rigid_body_weighs_as_its_shape_does(falling):
    area, square = 0.12 * 0.2, 0.12**2 + 0.2**2
    assert falling.solid_id.tolist() == [1]
    np.testing.assert_allclose(falling.solid_mass, 500.0 * area, rtol=1e-4)
    np.testing.assert_allclose(
        falling.solid_inertia, falling.solid_mass * square / 12, rtol=1e-4
    )


def test_collider_is_where_its_motion_has_it(mixed):
    states = mixed.states
    assert (states.poses[:, 0] == states.poses[0, 0]).all()
    assert (states.rates[:, 0] == 0.0).all()
    np.testing.assert_allclose(states.poses[0, :, :2], [[0.25, 0.25], [0.7, 0.35]])
    np.testing.assert_allclose(states.poses[:, 1, 2], 4.0 * states.time, atol=1e-5)
    np.testing.assert_allclose(states.rates[1:, 1], [[0.0, 0.0, 4.0]] * 23)


def test_angle_of_a_spinning_body_goes_on_past_a_turn(falling):
    angle = falling.poses[:, 0, 2]
    assert angle[-1] > 2 * np.pi
    np.testing.assert_allclose(angle, 60.0 * falling.time, atol=1e-4)
    np.testing.assert_allclose(
        falling.poses[:, 0, 0], 0.7 + 0.5 * falling.time, atol=1e-5
    )


@pytest.mark.parametrize("spin", [-500.0, -3.0, 0.0, 3.0, 500.0])
def test_angle_goes_on_even_if_a_frame_is_many_turns(spin):
    time = 0.04 * np.arange(9)
    angle = 1.0 + spin * time[:, None]
    wrapped = np.arctan2(np.sin(angle), np.cos(angle))
    found = unwrap(wrapped, np.full((9, 1), spin), time)
    np.testing.assert_allclose(found, angle, atol=1e-9)


def test_free_fall_changes_momentum_by_weight_times_time(falling):
    found, t = invariants(falling, falling.gravity), falling.time
    mass = found["mass"][0]
    assert (found["mass"] == mass).all()
    fall = found["momentum"] - found["momentum"][0]
    np.testing.assert_allclose(fall[:, 1], -mass * G * t, rtol=2e-5, atol=1e-6)
    np.testing.assert_allclose(fall[:, 0], 0.0, atol=1e-4)
    np.testing.assert_allclose(
        found["momentum"][0], [falling.solid_mass[0] * 0.5, 0.0], rtol=1e-6
    )


def test_free_fall_keeps_energy_to_the_order_of_the_scheme(falling):
    found = invariants(falling, falling.gravity)
    energy = found["kinetic_energy"] + found["potential_energy"]
    # Symplectic Euler falls by g t (t + dt) / 2, which is g t dt / 2 too far.
    lost = 0.5 * found["mass"] * G**2 * falling.time * DT
    np.testing.assert_allclose(energy[0] - energy, lost, rtol=0.01, atol=2e-3)
    assert found["kinetic_energy"][-1] > 10.0 * lost[-1]


def test_free_fall_changes_angular_momentum_by_the_moment_of_weight(falling):
    found, dt = invariants(falling, falling.gravity), np.diff(falling.time)
    arm = found["mass"] * found["center_of_mass"][:, 0]
    moment = -G * 0.5 * (arm[1:] + arm[:-1])
    turned = np.diff(found["angular_momentum"])
    np.testing.assert_allclose(turned, moment * dt, rtol=2e-3)
    own = falling.solid_inertia[0] * 60.0
    center = -falling.solid_mass[0] * 0.5 * 0.6  # y x momentum
    np.testing.assert_allclose(found["angular_momentum"][0], own + center, rtol=1e-5)


def test_invariants_count_the_born_and_rigid_bodies_but_no_colliders():
    found = invariants(made(), [1.0, -2.0])
    expected = {
        "mass": [12.0, 16.0],
        "momentum": [[6.0, 28.0], [4.0, 22.0]],
        "angular_momentum": [2 * (4 - 6) + 60 + 2.5, 4 - 4 + 60 + 2.5],
        "kinetic_energy": [25 + 20 + 6.25, 1 + 2 + 20 + 6.25],
        "potential_energy": [-2 + 8 - 30 + 20, -4 + 8 + 8 - 30 + 20],
        "center_of_mass": [[32 / 12, 14 / 12], [34 / 16, 18 / 16]],
        "largest_speed": [5.0, 2.0],
    }
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, err_msg=name)


def test_invariants_of_nothing_are_zero_and_have_no_center():
    nothing = np.full((2, 2, 2), np.nan, np.float32)
    states = made(positions=nothing, velocities=nothing, solid_mass=np.full(2, np.inf))
    found = invariants(states, [0.0, -1.0])
    assert np.isnan(found.pop("center_of_mass")).all()
    assert not any(values.any() for values in found.values())
    assert summary(states)["center_of_mass"] == {
        "first": [None, None],
        "last": [None, None],
    }


def test_a_particle_that_is_lost_is_not_overlooked():
    states = made()
    states.positions[1, 0] = np.nan
    found = invariants(states, [0.0, -1.0])
    assert found["mass"].tolist() == [12.0, 16.0]
    assert np.isnan(found["potential_energy"]).tolist() == [False, True]


def test_states_change_no_frame(data, mixed):
    outcome = outcome_of(data, states=False)
    assert outcome.states is None
    np.testing.assert_array_equal(outcome.frames, mixed.frames)


def test_two_runs_write_the_same_bytes(data, mixed, tmp_path):
    again = states_of(data, outcome_of(data))
    one, two = tmp_path / "one.npz", tmp_path / "new" / "two.npz"
    for dtype in ("float16", "float32"):
        save_states(one, mixed.states, dtype)
        save_states(two, again, dtype)
        assert one.read_bytes() == two.read_bytes()
    with zipfile.ZipFile(one) as archive:  # no timestamp but that of a zip of no date
        assert {info.date_time[0] for info in archive.infolist()} == {1980}
    assert {path.name for path in tmp_path.iterdir()} == {"one.npz", "new"}


def test_single_precision_survives_its_file_exactly(mixed, tmp_path):
    save_states(tmp_path / "states.npz", mixed.states)
    loaded = load_states(tmp_path / "states.npz")
    for name, values in vars(mixed.states).items():
        np.testing.assert_array_equal(getattr(loaded, name), values, strict=True)


def test_track_of_a_program_without_a_scene_has_a_file_too(data, tmp_path):
    path, track = tmp_path / "states.npz", outcome_of(data).states
    save_states(path, track)
    with np.load(path) as file:
        assert set(file) == set(vars(track))
        for name, values in vars(track).items():
            np.testing.assert_array_equal(file[name], values, strict=True)


def test_half_precision_file_is_within_half_precision_and_small(mixed, tmp_path):
    path, states = tmp_path / "states.npz", mixed.states
    save_states(path, states, "float16")
    loaded = load_states(path)
    assert loaded.positions.dtype == np.float32
    np.testing.assert_allclose(loaded.positions, states.positions, rtol=0, atol=2.5e-4)
    np.testing.assert_allclose(
        loaded.velocities, states.velocities, rtol=2**-11, atol=3e-8
    )
    np.testing.assert_array_equal(loaded.poses, states.poses)
    raw = states.positions.nbytes + states.velocities.nbytes
    assert path.stat().st_size < 0.5 * raw


def test_file_holds_the_invariants_of_the_states_as_they_were(mixed, tmp_path):
    path, states = tmp_path / "states.npz", mixed.states
    save_states(path, states, "float16")
    found = invariants(states, states.gravity)
    with np.load(path) as file:
        kept = {name for name in file.files if name.startswith("invariants/")}
        assert kept == {f"invariants/{name}" for name in found}
        for name, values in found.items():
            np.testing.assert_array_equal(file[f"invariants/{name}"], values)


def test_unknown_precision_is_refused_and_nothing_is_written(tmp_path):
    with pytest.raises(ValueError, match="dtype = 'float8', must be one of"):
        save_states(tmp_path / "states.npz", made(), "float8")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"text", b"PK\x03\x04"], ids=repr)
def test_file_that_holds_no_states_is_named(content, tmp_path):
    path = tmp_path / "other.npz"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"other\.npz: is not a file of states"):
        load_states(path)


def test_archive_of_something_else_is_named(tmp_path):
    path = tmp_path / "other.npz"
    np.savez(path, time=np.zeros(3))
    with pytest.raises(ValueError, match=r"not a file of states .*object_id"):
        load_states(path)
