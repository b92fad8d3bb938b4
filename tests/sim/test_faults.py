"""What simulations once did wrong, each as a whole kind, stays right."""

import numpy as np
import pytest
from benchmarks.physics.world import (
    WALL,
    block,
    body,
    box,
    disc,
    machine,
    matter,
    nozzle,
    simulate,
    world,
)

CELLS = 64
EDGE = WALL / CELLS


def turn(record, index=0):
    """Largest turn of a solid from how it started [deg]."""
    angle = record.pose(index)[:, 2]
    return np.degrees(abs(angle - angle[0]).max())


@pytest.mark.parametrize("restitution", [0.2, 0.5])
@pytest.mark.parametrize("size", [(0.12, 0.1), (0.3, 0.04)], ids=["box", "plank"])
def test_a_rigid_body_that_lands_flat_does_not_turn(size, restitution):
    heavy = matter("rigid", restitution=restitution)
    scene = world(body(box((0.5, 0.35), *size), heavy), cells=CELLS, seconds=1.5)
    record = simulate(scene)
    pose, drop = record.pose(0), 0.35 - EDGE - size[1] / 2
    assert turn(record) < 0.5  # by symmetry it is 0
    assert abs(pose[:, 0] - 0.5).max() * CELLS < 0.1
    landed = int(np.argmax(np.diff(pose[:, 1]) > 0.0))
    rise = pose[landed:, 1].max() - EDGE - size[1] / 2
    assert rise / drop == pytest.approx(restitution**2, abs=0.04)


def test_two_rigid_boxes_that_meet_head_on_do_not_turn():
    heavy = matter("rigid", restitution=0.5)
    boxes = [
        body(box((x, 0.5), 0.1, 0.1), heavy, velocity=(u, 0.0))
        for x, u in ((0.3, 1.0), (0.7, -1.0))
    ]
    record = simulate(world(*boxes, cells=CELLS, seconds=0.35, gravity=(0.0, 0.0)))
    for index, speed in ((0, -0.5), (1, 0.5)):
        assert turn(record, index) < 0.5
        assert record.rate(index)[-1, 0] == pytest.approx(speed, abs=0.03)


def test_a_stack_of_rigid_boxes_stands():
    heavy = matter("rigid", friction=0.5)
    size = 0.16, 0.0995
    boxes = [body(box((0.5, EDGE + 0.05 + 0.1 * i), *size), heavy) for i in range(4)]
    record = simulate(world(*boxes, cells=CELLS, seconds=2.0))
    for index in range(4):
        assert turn(record, index) < 0.5
        pose = record.pose(index)
        assert abs(pose[:, :2] - pose[0, :2]).max() * CELLS < 0.2


def test_a_pressed_mesh_recovers():
    """It is pressed to less than a third of its height, and let go."""
    radius = 0.08
    gum = matter("elastic_fem", youngs_modulus=3e5)
    swing = {
        "type": "oscillate",
        "amplitude": [0.0, 0.07],
        "frequency": 1.0,
        "phase_deg": 90.0,
        "stop": 1.0,
    }
    plate = machine(box((0.5, EDGE + 2 * radius + 0.035), 0.4, 0.05), swing)
    ball = body(disc((0.5, EDGE + radius), radius), gum)
    record = simulate(world(ball, plate, cells=128, seconds=1.5))
    x = record.x(0)
    spread = np.sqrt(np.linalg.det(np.array([np.cov(points.T) for points in x])))
    assert spread.min() / spread[0] > 0.4  # an elastic body of particles: 0.5
    assert spread[-1] / spread[0] == pytest.approx(1.0, abs=0.1)
    assert np.hypot(*record.v(0).T).max() < 10.0


@pytest.mark.parametrize("model", ["elastic", "rigid"])
def test_nothing_is_born_inside_a_body(model):
    """A block rises around a nozzle of sand before it opens."""
    rising = body(block(0.35, 0.3, 0.3, 0.3), matter(model), velocity=(0.0, 0.6))
    jet = {"rate": 400.0, "velocity": [0.0, -0.5], "start": 0.3, "stop": 0.5}
    sand = nozzle(box((0.5, 0.66), 0.06, 0.03), jet, matter("sand"))
    still = (0.0, -0.01)
    record = simulate(world(rising, sand, cells=CELLS, seconds=0.6, gravity=still))
    states = record.states
    assert (states.object_id == 1).sum() > 50
    assert not states.born[-1, states.object_id == 1].any()
