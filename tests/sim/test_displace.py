"""A displaced program starts a hair away, and looks the same at first."""

import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.displace import DISTANCE, displaced
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, FAN, JET, LIQUID, scene_data

BRICK = BODY | {
    "physics_properties": {
        "constitutive_model": "rigid",
        "density": 800.0,
        "restitution": 0.3,
        "friction": 0.3,
    }
}
OTHER = BODY | {
    "name": "object_5",
    "shape": {"type": "circle", "center": [0.6, 0.8], "radius": 0.08},
    "physics_properties": LIQUID,
    "visualization": {"color": "#2C90F5"},
}
LOW = BRICK | {
    "name": "object_6",
    "shape": {"type": "box", "center": [0.25, 0.25], "size": [0.12, 0.11]},
    "visualization": {"color": "#2CF52D"},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "things",
    [
        [BODY, JET],
        [BRICK],
        [BRICK, JET],
        [BODY, OTHER, FAN],
        [BODY, OTHER, FAN, LOW],
    ],
    ids=["jet", "rigid", "rigid and jet", "bodies and mover", "all"],
)
def test_matter_and_rigid_bodies_start_at_most_a_hair_away(things):
    program = link(Scene.from_data(scene_data(*things)))
    before = run(program, 2, states=True)
    after, again = (run(displaced(program, 1), 2, states=True) for _ in range(2))
    np.testing.assert_array_equal(after.frames[0], before.expect()[0])
    np.testing.assert_array_equal(after.states.positions, again.states.positions)
    rigid = any(thing in things for thing in (BRICK, LOW))  # a mover stays in its place
    for name, free in (("positions", True), ("poses", rigid)):
        one, other = (getattr(o.states, name)[1] for o in (before, after))
        apart = np.nanmax(abs(other[..., :2] - one[..., :2]), initial=0.0)
        assert apart < 100 * DISTANCE
        assert not one.size or (apart > 0.0) == free


@pytest.mark.slow
def test_another_seed_is_another_displacement():
    program = link(Scene.from_data(scene_data(BODY)))
    one, other = (run(displaced(program, k), 2, states=True) for k in (1, 2))
    assert (one.states.positions[1] != other.states.positions[1]).any()
