"""A displaced program starts a hair away, and looks the same at first."""

import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.displace import DISTANCE, displaced
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, JET, scene_data

BRICK = BODY | {
    "physics_properties": {
        "constitutive_model": "rigid",
        "density": 800.0,
        "restitution": 0.3,
        "friction": 0.3,
    }
}


@pytest.mark.slow
@pytest.mark.parametrize("things", [[BODY, JET], [BRICK], [BRICK, JET]])
def test_matter_and_rigid_bodies_start_at_most_a_hair_away(things):
    program = link(Scene.from_data(scene_data(*things)))
    before = run(program, 2, states=True)
    after, again = (run(displaced(program, 1), 2, states=True) for _ in range(2))
    np.testing.assert_array_equal(after.frames[0], before.expect()[0])
    np.testing.assert_array_equal(after.states.positions, again.states.positions)
    for name in ("positions", "poses"):
        one, other = (getattr(o.states, name)[1] for o in (before, after))
        apart = np.nanmax(abs(other[..., :2] - one[..., :2]), initial=0.0)
        if one.size:
            assert 0.0 < apart < 100 * DISTANCE


@pytest.mark.slow
def test_another_seed_is_another_displacement():
    program = link(Scene.from_data(scene_data(BODY)))
    one, other = (run(displaced(program, k), 2, states=True) for k in (1, 2))
    assert (one.states.positions[1] != other.states.positions[1]).any()
