"""What is measured on states and pictures, on ones that are made by hand."""

import dataclasses

import numpy as np
import pytest

from mpmworlds.builder.plan import measures
from mpmworlds.sim.scene.scene import Scene
from tests.builder.plan.test_screen import FRAMES, states_of, still
from tests.sim.scenes import BODY, OBSTACLE, scene_data

MESH = BODY | {
    "physics_properties": BODY["physics_properties"]
    | {"constitutive_model": "elastic_fem"}
}


# ---- motion


def disk(x, color=1):
    """A disk of six pixels in a picture of 32."""
    i, j = np.mgrid[:32, :32]
    return np.where((i - 16) ** 2 + (j - x) ** 2 < 36, color, 0)


def test_what_stays_does_not_move():
    assert measures.motion(np.array([disk(9)] * 16), 30) == 0.0


def test_what_goes_elsewhere_in_a_second_moves_as_a_whole():
    assert measures.motion(np.array([disk(7), disk(7), disk(25), disk(25)]), 30) == 1.0


def test_motion_is_what_half_of_the_time_has():
    moving = [disk(8 + n) for n in range(8)]
    rests = [disk(15)] * 8
    assert measures.motion(np.array(moving + rests[:4]), 30) > 0.1
    assert measures.motion(np.array(moving[:4] + rests), 30) == 0.0


def test_another_colour_in_the_same_place_is_a_change():
    assert (
        measures.motion(np.array([disk(9, 1 + n % 4 // 2) for n in range(8)]), 30) == 1
    )


def test_an_empty_picture_does_not_move():
    assert measures.motion(np.zeros((8, 4, 4), int), 30) == 0.0
    assert measures.motion(np.array([disk(9)]), 30) == 0.0


def test_views_show_particles_and_solids_where_they_are():
    scene = Scene.from_data(scene_data(BODY, OBSTACLE))
    x = still(4)
    x[:, 3] = np.nan
    poses = np.full((FRAMES, 1, 3), 0.0)
    poses[:, 0, :2] = scene.objects[1].shape.center
    states = states_of(x, poses=poses, solid_mass=[np.inf])
    (picture, *_) = measures.views(scene, states, 75)
    column, row = (x[0, 0] * measures.VIEW).astype(int)
    assert picture[row, column] == 1
    column, row = (np.array(scene.objects[1].shape.center) * measures.VIEW).astype(int)
    assert picture[row, column] == 2
    assert len(measures.views(scene, states, 75)) == 4


# ---- meshes and crowds


def lattice(scene, side=10):
    """Vertices of a square mesh, (FRAMES, side^2, 2)."""
    step = 0.5 / scene.simulation.grid_resolution
    i, j = np.mgrid[:side, :side].reshape(2, -1) + 20
    return np.tile(np.stack([i + 0.5, j + 0.5], axis=1) * step, (FRAMES, 1, 1))


def test_a_mesh_that_turns_and_stretches_is_not_inside_out():
    scene = Scene.from_data(scene_data(MESH))
    x = lattice(scene)
    x[30:] = (x[30:] - 0.5) @ np.array([[0.0, 2.0], [-0.5, 0.0]]) + 0.5
    assert measures.inverted(scene, states_of(x)) == 0.0


def test_a_folded_corner_is_inside_out():
    scene = Scene.from_data(scene_data(MESH))
    x = lattice(scene)
    x[60:, 0] += 10 * (x[0, 11] - x[0, 0])  # across its own triangle
    assert measures.inverted(scene, states_of(x)) == pytest.approx(1 / 81)
    other = Scene.from_data(scene_data(BODY))
    assert measures.inverted(other, states_of(x)) == 0.0


def test_matter_in_overfull_cells_is_crowded():
    scene = Scene.from_data(scene_data(BODY))
    assert measures.crowded(scene, states_of(lattice(scene))) == 0.0
    x = lattice(scene)
    x[45:60, :13] = x[0, 0]
    assert measures.crowded(scene, states_of(x)) >= 0.13
    gone = dataclasses.replace(states_of(x), positions=np.full_like(x, 2.0))
    assert measures.crowded(scene, gone) == 0.0
