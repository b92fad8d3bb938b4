"""In any scene, matter stays finite, inside, out of solids, and not too fast."""

from dataclasses import dataclass

import numpy as np
import pytest
from benchmarks.physics.contact import signed_depth

from mpmworlds.builder.plan.screen import fastest_explained
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.run.states import States, invariants
from mpmworlds.sim.scene.scale import rescale
from tests.sim.scenes import random_scene

CELLS, PIXELS, FRAMES = 64, 32, 61  # walls of seeds are then 3 cells
FEW, MANY = 6, 200
STEP = 6  # frames between those whose depths are measured


@dataclass(frozen=True)
class Trial:
    """A scene and its states."""

    scene: object
    states: object

    def depth(self):
        """Deepest particle in a collider or rigid body [cells]."""
        deepest = 0.0
        for n, index in enumerate(self.states.solid_id):
            for t in range(0, len(self.states.time), STEP):
                points = self.states.positions[t][self.states.born[t]]
                pose = self.states.poses[t, n]
                depth = signed_depth(self.scene, index, pose, points)
                deepest = max(deepest, depth.max(initial=0.0))
        return deepest * self.scene.simulation.grid_resolution


def trial_of(scene):
    """Run of a scene at a low resolution."""
    small = rescale(scene, CELLS, PIXELS, FRAMES)
    outcome = run(link(small), timeout=300, states=True)
    assert outcome.status == "ok", outcome.message
    return Trial(small, States.of(small, outcome.states))


def check(trial):
    """Hold a run to what every run must have."""
    scene, states = trial.scene, trial.states
    born = states.born
    bodies = states.poses[:, np.isfinite(states.solid_mass), :2].reshape(-1, 2)
    x = np.concatenate([states.positions[born], bodies])
    for values in (x, states.velocities[born], states.poses, states.rates):
        assert np.isfinite(values).all()
    assert x.min() > 0.0 and x.max() < 1.0
    assert trial.depth() <= 1.0
    found = invariants(states, states.gravity)
    fastest = found["largest_speed"].max()
    assert fastest <= fastest_explained(scene), f"{fastest:.1f} m/s"
    if all(thing.object_type == "dynamic_body" for thing in scene.objects):
        energy = found["kinetic_energy"] + found["potential_energy"]
        bottom = lowest_potential(scene, states)
        part = (energy - bottom) / (energy[0] - bottom)
        assert part.max() <= 1.01, "energy from nowhere"


def lowest_potential(scene, states):
    """Potential energy [J] of all the mass in the corner that gravity points to."""
    edge = scene.environment.walls.thickness_cells / scene.simulation.grid_resolution
    gravity = np.array(scene.environment.gravity)
    corner = np.where(gravity > 0.0, 1.0 - edge, edge)
    rigid = states.solid_mass[np.isfinite(states.solid_mass)]
    return -(states.mass.sum() + rigid.sum()) * float(gravity @ corner)


@pytest.mark.long
@pytest.mark.parametrize("name", load_seeds())
def test_seeds_behave(name):
    check(trial_of(load_seeds()[name]))


@pytest.mark.parametrize("number", range(FEW))
def test_some_random_scenes_behave(number):
    check(trial_of(random_scene(number)))


@pytest.mark.long
@pytest.mark.parametrize("number", range(FEW, MANY))
def test_random_scenes_behave(number):
    check(trial_of(random_scene(number)))
