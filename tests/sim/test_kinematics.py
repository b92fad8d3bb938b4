"""Strain, transfer, contact and prescribed motion do what their names say."""

import numpy as np
import pytest
import taichi as ti
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from taichi.math import vec2

from mpmworlds.sim.motions import MOTIONS, Kinematics
from mpmworlds.sim.physics.contact import touch
from mpmworlds.sim.physics.deformation import advance, newtonian, restretch
from mpmworlds.sim.physics.motion import conveyor, oscillate, rotate, translate
from mpmworlds.sim.physics.splines import bspline
from tests.sim.lab import (
    N,
    deformations,
    generators,
    many,
    matrix,
    pair,
    parts,
    symmetric,
    vectorised,
)


@ti.func
def _advance(r):
    a, b = advance(
        vec2(r[0], r[1]), vec2(r[2], r[3]), vec2(r[4], r[5]), vec2(r[6], r[7]), r[8]
    )
    return ti.Vector([a.x, a.y, b.x, b.y])


@ti.func
def _newtonian(r):
    t, z = newtonian(r[0], vec2(r[1], r[2]), r[3], vec2(r[4], r[5]), vec2(r[6], r[7]))
    return ti.Vector([t, z.x, z.y])


@ti.func
def _restretch(r):
    a, b = restretch(vec2(r[0], r[1]), vec2(r[2], r[3]), r[4], r[5])
    return ti.Vector([a.x, a.y, b.x, b.y])


@ti.func
def _touch(r):
    v = touch(vec2(r[0], r[1]), vec2(r[2], r[3]), vec2(r[4], r[5]), r[6], r[7])
    return ti.Vector([v.x, v.y])


@ti.func
def _bspline(r):
    w = bspline(vec2(r[0], r[1]))
    return ti.Vector([w[0].x, w[1].x, w[2].x, w[0].y, w[1].y, w[2].y])


ADVANCE = vectorised(_advance, 4)
NEWTONIAN = vectorised(_newtonian, 3)
RESTRETCH = vectorised(_restretch, 4)
TOUCH = vectorised(_touch, 2)
BSPLINE = vectorised(_bspline, 6)


@many
@given(rng=generators)
def test_advancing_a_strain_is_the_matrix_product(rng):
    F, C = deformations(rng, 0.3, 2.0), rng.normal(size=(N, 2, 2))
    found = ADVANCE(*parts(*pair(F), *pair(C)), 0.01)
    expected = (np.eye(2) + 0.01 * C) @ F
    np.testing.assert_allclose(found, parts(*pair(expected)), atol=1e-14)


@many
@given(rng=generators)
def test_viscous_stress_is_the_symmetric_velocity_gradient(rng):
    C = rng.normal(size=(N, 2, 2))
    t, z_x, z_y = rng.normal(size=(3, N))
    found = symmetric(*NEWTONIAN(t, z_x, z_y, 0.7, *parts(*pair(C))))
    added = 0.7 * (C + C.transpose(0, 2, 1))
    np.testing.assert_allclose(found, symmetric(t, z_x, z_y) + added, atol=1e-14)


@many
@given(rng=generators)
def test_restretching_sets_singular_values_and_keeps_rotations(rng):
    F = deformations(rng, 0.3, 2.0)
    s = np.sort(rng.uniform(0.3, 2.0, (N, 2)), axis=1)[:, ::-1]
    a_x, a_y, b_x, b_y = RESTRETCH(*parts(*pair(F)), *s.T)
    U, _, V = np.linalg.svd(F)
    expected = U @ (s[:, :, None] * np.eye(2)) @ V
    found = matrix(a_x + 1j * a_y, b_x + 1j * b_y)
    np.testing.assert_allclose(found, expected, atol=1e-6)


@many
@given(rng=generators)
def test_splines_reproduce_constants_lines_and_a_known_second_moment(rng):
    f = rng.uniform(0.5, 1.5, (2, N))
    w = BSPLINE(*f).reshape(2, 3, N)
    offset = np.arange(3)[:, None] - f[:, None]
    assert (w >= 0).all()
    np.testing.assert_allclose(w.sum(1), 1)
    np.testing.assert_allclose((w * offset).sum(1), 0, atol=1e-14)
    np.testing.assert_allclose((w * offset**2).sum(1), 0.25)


def contact(rng, law, friction):
    """Velocities relative to a moving surface: normal and tangent, before and after."""
    v, surface = rng.normal(size=(2, 2, N))
    n = np.exp(1j * rng.uniform(0, 2 * np.pi, N))
    found = TOUCH(*v, *surface, *parts(n), law, friction)
    before, after = (u[0] + 1j * u[1] for u in (v - surface, found - surface))
    return *parts(before * n.conj()), *parts(after * n.conj())


@many
@given(rng=generators)
def test_a_sticky_surface_takes_matter_along(rng):
    *_, normal, tangent = contact(rng, 0, 0.3)
    np.testing.assert_allclose([normal, tangent], 0, atol=1e-14)


@many
@given(rng=generators)
def test_a_slip_surface_stops_normal_motion_either_way(rng):
    _, tangent, new_normal, new_tangent = contact(rng, 1, 0.0)
    np.testing.assert_allclose(new_normal, 0, atol=1e-14)
    np.testing.assert_allclose(new_tangent, tangent, atol=1e-12)


@many
@given(rng=generators)
def test_a_separating_surface_lets_go_and_never_lets_in(rng):
    normal, tangent, new_normal, new_tangent = contact(rng, 2, 0.3)
    assert (new_normal > -1e-14).all()
    leaving = normal > 0
    np.testing.assert_allclose(new_normal[leaving], normal[leaving])
    np.testing.assert_allclose(new_tangent[leaving], tangent[leaving])


@pytest.mark.parametrize("law", [1, 2])
@many
@given(rng=generators, friction=st.floats(0, 2))
def test_friction_is_bounded_by_coulomb_and_never_reverses(law, rng, friction):
    normal, tangent, _, new_tangent = contact(rng, law, friction)
    pressed = (-normal).clip(0)
    lost = abs(tangent) - abs(new_tangent)
    assert (lost >= -1e-12).all()
    np.testing.assert_allclose(
        lost, np.minimum(friction * pressed, abs(tangent)), atol=1e-9
    )
    assert (new_tangent * tangent >= -1e-14).all()


SPIN = {"type": "rotate", "angular_velocity": 3.0}
GLIDE = {"type": "translate", "velocity": [0.5, -2.0]}
SWING = {"type": "oscillate", "amplitude": [0.1, -0.2], "frequency": 1.25}
ROCK = {"type": "oscillate", "amplitude_deg": 30.0, "frequency": 2.0}
BELT = {"type": "conveyor", "surface_speed": -0.7}
FUNCTIONS = {
    "conveyor": conveyor,
    "oscillate": oscillate,
    "rotate": rotate,
    "translate": translate,
}


def course(data, t):
    """A motion of the schema, and its displacements (3, n) and rates (4, n) at t."""
    motion = TypeAdapter(Kinematics).validate_python(data)
    function, given = FUNCTIONS[motion.type], motion.model_dump(mode="json")

    @ti.func
    def displaced(r):
        p, v = function(r[0], given)
        return ti.Vector([p.x, p.y, p.z, v.x, v.y, v.z, v.w])

    found = vectorised(displaced, 7)(t)
    return motion, found[:3], found[3:]


def test_every_motion_of_the_schema_is_tested():
    assert FUNCTIONS.keys() == MOTIONS.keys()
    assert {motion["type"] for motion in MOVING} == MOTIONS.keys()


MOVING = (
    SPIN,
    SPIN | {"start": 0.25, "stop": 0.75},
    GLIDE | {"stop": 1.0},
    GLIDE | {"start": 0.25, "stop": 0.75},
    SWING,
    SWING | {"start": 0.2, "stop": 0.9, "phase_deg": 90.0},
    ROCK | {"phase_deg": -40.0},
    BELT | {"start": 0.5},
)
motions = pytest.mark.parametrize("data", MOVING)
TIMES = np.linspace(0, 1, 20_002)


@motions
def test_a_motion_starts_at_rest_position_and_moves_at_its_rate(data):
    _, moved, rate = course(data, TIMES)
    np.testing.assert_allclose(moved[:, 0], 0)
    speed = np.diff(moved) / np.diff(TIMES)
    smooth = (abs(np.diff(rate)) < 0.02).all(0)
    assert smooth.sum() >= len(TIMES) - 3  # but for its start and its stop
    middle = 0.5 * (rate[:3, 1:] + rate[:3, :-1])
    np.testing.assert_allclose(speed[:, smooth], middle[:, smooth], atol=1e-4)


@motions
def test_a_motion_rests_before_its_start_and_after_its_stop(data):
    motion, moved, rate = course(data, TIMES)
    before, after = motion.start > TIMES, motion.stop <= TIMES
    np.testing.assert_array_equal(moved[:, before], 0)
    np.testing.assert_array_equal(rate[:, before | after], 0)
    assert abs(rate[:, ~(before | after)]).max() > 0
    assert (np.diff(moved[:, after]) == 0).all()


@motions
def test_a_motion_knows_how_fast_it_is_and_how_far_it_leads(data):
    motion, moved, rate = course(data, TIMES)
    reach = 0.3
    glide = np.hypot(*rate[:2]) + abs(rate[2]) * reach + abs(rate[3])
    assert motion.fastest(reach) == pytest.approx(glide.max(), rel=1e-3)
    poses = np.array([[*shift, turn] for shift, turn in motion.poses()])
    turned = abs(moved[2]) <= 2 * np.pi
    assert (moved[:, turned].min(1) >= poses.min(0) - 1e-9).all()
    assert (moved[:, turned].max(1) <= poses.max(0) + 1e-9).all()


@pytest.mark.parametrize(
    ("data", "moved"),
    [
        (SPIN, [0.0, 0.0, 3.0]),
        (GLIDE | {"start": 0.25, "stop": 0.75}, [0.25, -1.0, 0.0]),
        (SWING | {"phase_deg": 90.0, "stop": 0.4}, [-0.2, 0.4, 0.0]),
        (ROCK | {"stop": 0.125}, [0.0, 0.0, np.pi / 6]),
        (BELT, [0.0, 0.0, 0.0]),
    ],
)
def test_a_motion_ends_where_geometry_says(data, moved):
    np.testing.assert_allclose(course(data, TIMES[-1:])[1][:, 0], moved, atol=1e-12)


def test_an_oscillation_that_moves_nothing_is_refused():
    with pytest.raises(ValidationError, match="one of them must differ from 0"):
        course({"type": "oscillate", "frequency": 1.0}, TIMES)
