"""Programs move matter as mechanics says, and colliders as their scene says."""

import subprocess
import sys
from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.program.linking.cast import Cast
from mpmworlds.sim.scene.palette import rgb
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, FAN, GATE, JET, LIQUID, OBSTACLE, SAND, scene_data

G = 9.8
DX = 1 / 32
RECORD = """\
import sys
import numpy as np
import program
frames, x, v = [], [], []
for frame in program.frames():
    frames.append(frame)
    x.append(program.x.to_numpy())
    v.append(program.v.to_numpy())
np.savez(sys.argv[1], frames=frames, x=x, v=v, owner=program.owner.to_numpy())
"""


@dataclass(frozen=True)
class Record:
    """A run: frames (T, H, W, 3), positions and velocities (T, n, 2) when drawn."""

    scene: Scene
    frames: np.ndarray
    x: np.ndarray
    v: np.ndarray
    owner: np.ndarray

    @property
    def time(self):
        """Time of every frame [s]."""
        sim = self.scene.simulation
        return sim.time_step_dt * sim.substeps_per_frame * np.arange(len(self.x))

    def mask(self, index):
        """Where an object is seen (T, H, W)."""
        color = rgb(self.scene.objects[index].visualization.color)
        return (self.frames == color).all(-1)


def body(index, center, color, **parts):
    """A small square body."""
    shape = {"type": "box", "center": center, "size": [0.12, 0.12]}
    look = {"visualization": {"color": color}}
    return BODY | {"name": f"object_{index}", "shape": shape} | look | parts


def moving(*velocity):
    return {"initial_state": {"velocity": list(velocity), "angular_velocity": 0.0}}


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """Function data -> record of a run of its program."""

    def run(data):
        scene, folder = Scene.from_data(data), tmp_path_factory.mktemp("run")
        folder.joinpath("program.py").write_text(link(scene), "ascii")
        folder.joinpath("record.py").write_text(RECORD, "ascii")
        command = [sys.executable, "record.py", "states.npz"]
        subprocess.run(command, cwd=folder, check=True, timeout=300)
        found = dict(np.load(folder / "states.npz"))
        numbers = [scene.objects.index(thing) for thing in Cast(scene).matter]
        found["owner"] = np.array(numbers)[found["owner"]]
        return Record(scene, **found)

    return run


@pytest.fixture(scope="module")
def falling(record):
    """A spinning body falls above an obstacle, beside a fan below a jet."""
    spin = {"initial_state": {"velocity": [0.4, 0.5], "angular_velocity": 3.0}}
    return record(scene_data(BODY | spin, OBSTACLE, FAN, JET, frames=15, pixels=128))


@pytest.fixture(scope="module")
def floating(record):
    """Without gravity: one body flies alone, two collide, a gate rises."""
    gate = GATE | {"shape": {"type": "box", "center": [0.93, 0.3], "size": [0.06, 0.3]}}
    bodies = [
        body(0, [0.2, 0.25], "#F52D2C", **moving(1.0, 0.3)),
        body(1, [0.3, 0.7], "#2CF52D", **moving(1.0, 0.0)),
        body(3, [0.6, 0.72], "#2C2DF5", **moving(-1.0, 0.0)),
    ]
    return record(scene_data(*bodies, gate, gravity=[0.0, 0.0], frames=20, pixels=128))


@pytest.fixture(scope="module")
def resting(record):
    """On a plate across the domain a body rests; behind a wall, matter drops on it."""
    plate = OBSTACLE | {
        "shape": {"type": "box", "center": [0.5, 0.25], "size": [1.0, 0.1]}
    }
    sand = body(2, [0.5, 0.5], "#F5F42C", physics_properties=SAND, **moving(0.0, -2.0))
    water = body(3, [0.8, 0.5], "#2C90F5", physics_properties=LIQUID)
    block = body(0, [0.2, 0.36], "#F52D2C")
    shape = {"type": "box", "center": [0.35, 0.5], "size": [0.06, 0.5]}
    wall = OBSTACLE | {"name": "object_4", "shape": shape}
    return record(scene_data(block, plate, sand, water, wall, frames=40))


def test_free_fall_is_that_of_the_scheme(falling):
    mine = falling.owner == 0
    center = falling.x[:, mine].mean(1, dtype=np.float64)
    start = falling.v[0, mine].mean(0, dtype=np.float64)
    dt = falling.scene.simulation.time_step_dt
    t = falling.time[:, None]
    gravity = -0.5 * G * t * (t + dt)  # symplectic Euler; -g t^2 / 2 in the limit
    flight = center[0] + t * start + gravity * [0, 1]
    np.testing.assert_allclose(start, [0.4, 0.5], atol=0.02)
    assert np.ptp(center[:, 1]) > 0.02
    np.testing.assert_allclose(center, flight, atol=1e-5)


def test_a_free_body_keeps_its_spin(falling):
    mine = falling.owner == 0
    arm = falling.x[:, mine] - falling.x[:, mine].mean(1, keepdims=True)
    z = arm @ [1, 1j]
    turned = np.angle((z * z[0].conj()).sum(1))
    np.testing.assert_allclose(turned, 3.0 * falling.time, atol=0.02)


def test_a_jet_emits_its_rate(falling):
    jet = falling.scene.objects[3].emission
    moved = (falling.x[:, falling.owner == 3] != falling.x[0, falling.owner == 3]).any(
        2
    )
    np.testing.assert_allclose(moved.sum(1), jet.rate * falling.time, atol=1)


def test_a_jet_leaves_the_nozzle_at_its_velocity(falling):
    jet = falling.x[:, falling.owner == 3]
    t = falling.time[5]
    low = 0.85 - 1.5 * t - 0.5 * G * t**2
    assert jet[5, :, 1].min() == pytest.approx(low, abs=DX / 2)
    assert abs(jet[5, :, 0] - 0.7).max() < 0.04 + DX / 2


def seen(outline, pixels):
    """Pixels that an outline covers, the top row first."""
    image = np.zeros((pixels, pixels), np.uint8)
    for polygon in outline:
        corners = (polygon * [1, -1] + [0, 1]) * pixels - 0.5
        cv2.fillPoly(image, [np.rint(corners * 16).astype(np.int32)], 1, shift=4)
    return image > 0


def overlap_of(record, index, poses):
    """Intersection over union of an object's mask with its outline in each pose."""
    shape, masks = record.scene.objects[index].shape, record.mask(index)
    expected = np.array([seen(shape.outline(*pose), masks.shape[1]) for pose in poses])
    return (masks & expected).sum((1, 2)) / (masks | expected).sum((1, 2))


def test_an_obstacle_is_seen_where_its_outline_is(falling):
    assert overlap_of(falling, 1, [((0, 0), 0)] * 15).min() > 0.9


def test_a_fan_is_seen_to_turn_as_prescribed(falling):
    poses = [((0, 0), 4.0 * t) for t in falling.time]
    assert overlap_of(falling, 2, poses).min() > 0.8
    assert overlap_of(falling, 2, poses[::-1])[0] < 0.6


def test_a_gate_is_seen_to_move_as_prescribed(floating):
    shifts = [(0.0, 2.0 * np.clip(t - 0.05, 0.0, 0.1)) for t in floating.time]
    assert overlap_of(floating, 3, [(shift, 0) for shift in shifts]).min() > 0.9
    assert shifts[0] != shifts[-1]


def test_without_gravity_a_body_flies_straight(floating):
    mine = floating.owner == 0
    t = floating.time[:, None, None]
    straight = floating.x[0, mine] + t * [1.0, 0.3]
    np.testing.assert_allclose(floating.x[:, mine], straight, atol=2e-5)


def test_a_collision_keeps_momentum(floating):
    pair = np.isin(floating.owner, (1, 2))
    velocity = floating.v[:, pair].mean(1, dtype=np.float64)
    first = floating.v[:, floating.owner == 1].mean(1)
    assert abs(first[-1] - first[0]).max() > 0.5
    np.testing.assert_allclose(velocity, velocity[:1].repeat(20, 0), atol=1e-5)


def test_bodies_are_seen_where_their_particles_are(floating):
    mask = floating.mask(0)
    size = mask.shape[1]
    for frame, points in zip(mask, floating.x[:, floating.owner == 0], strict=True):
        rows, columns = np.nonzero(frame)
        center = (columns.mean() + 0.5) / size, 1 - (rows.mean() + 0.5) / size
        np.testing.assert_allclose(center, points.mean(0), atol=1 / size)
        x, y = (points * size).astype(int).T
        assert frame[size - 1 - y, x].mean() > 0.98
        pixels = np.stack([columns + 0.5, size - 0.5 - rows], axis=1) / size
        gaps = np.linalg.norm(pixels[:, None] - points, axis=2).min(1)
        assert gaps.max() < 1.25 * DX / 2  # DX / 2 is the spacing of particles


def test_a_body_at_rest_stays_where_it_is(resting):
    center = resting.x[:, resting.owner == 0].mean(1)
    np.testing.assert_allclose(center[:, 0], center[0, 0], atol=DX / 20)
    np.testing.assert_allclose(center[:, 1], center[0, 1], atol=DX / 2)
    assert abs(resting.v[-1, resting.owner == 0]).mean() < 0.05


def test_no_particle_passes_a_static_collider(resting):
    assert np.isfinite(resting.x).all()
    assert resting.x[..., 1].min() >= 0.3 - 1e-6


def test_no_particle_leaves_the_domain(falling, floating, resting):
    for x in (falling.x, floating.x, resting.x):
        assert ((x >= 2 * DX) & (x <= 1 - 2 * DX)).all()
