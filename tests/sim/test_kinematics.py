"""Strain, transfer, contact and prescribed motion do what their names say."""

import numpy as np
import pytest
import taichi as ti
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from taichi.math import vec2

from mpmworlds.sim.program.features.shapes.box import Box
from mpmworlds.sim.program.linking.layout import indented
from mpmworlds.sim.program.linking.places import belt, pasted
from mpmworlds.sim.program.linking.texts import row
from mpmworlds.sim.scene.objects import (
    CONTACTS,
    MOTIONS,
    KinematicCollider,
    Kinematics,
)
from tests.sim.lab import N, Particles, functions, generators, made, many, vectorised

SPLINES = functions(GRID=1)


@ti.func
def _bspline(r):
    base, _, w = SPLINES.stencil(vec2(r[0], r[1]))
    return ti.Vector([base.x, base.y, w[0].x, w[1].x, w[2].x, w[0].y, w[1].y, w[2].y])


BSPLINE = vectorised(_bspline, 8)


@many
@given(rng=generators)
def test_splines_reproduce_constants_lines_and_a_known_second_moment(rng):
    p = rng.uniform(3.0, 9.0, (2, N))
    base, w = np.split(BSPLINE(*p), [2])
    w = w.reshape(2, 3, N)
    offset = np.arange(3)[:, None] + base[:, None] - p[:, None]
    assert (w >= 0).all()
    np.testing.assert_allclose(w.sum(1), 1)
    np.testing.assert_allclose((w * offset).sum(1), 0, atol=1e-14)
    np.testing.assert_allclose((w * offset**2).sum(1), 0.25)


def parts(*numbers):
    """Real and imaginary parts of complex arrays, one after the other."""
    return [part for z in numbers for part in (z.real, z.imag)]


def contact_of(law, hook, friction):
    """Code of a contact law for node velocity u, normal n and surface velocity w."""
    inputs = {"u": "vec2", "n": "vec2"} | ({"w": "vec2"} if hook == "meet" else {})
    lines = pasted(law, hook, friction=repr(friction))
    return Particles(lines, "u", inputs, "vec2")


def test_every_contact_law_of_the_schema_is_tested():
    assert set(CONTACTS) == {"separate", "slip", "sticky"}


def contact(rng, law, friction):
    """Velocities relative to a moving surface: normal and tangent, before and after."""
    v, surface = rng.normal(size=(2, 2, N))
    n = np.exp(1j * rng.uniform(0, 2 * np.pi, N))
    normal, relative = np.array(parts(n)).T, (v - surface).T
    at_rest = contact_of(law, "touch", friction)(u=relative, n=normal)["outcome"]
    found = contact_of(law, "meet", friction)(u=v.T, n=normal, w=surface.T)["outcome"].T
    np.testing.assert_allclose(at_rest, found.T - surface.T, atol=1e-12)
    before, after = (u[0] + 1j * u[1] for u in (v - surface, found - surface))
    return *parts(before * n.conj()), *parts(after * n.conj())


@many
@given(rng=generators)
def test_a_sticky_surface_takes_matter_along(rng):
    *_, normal, tangent = contact(rng, "sticky", 0.3)
    np.testing.assert_allclose([normal, tangent], 0, atol=1e-14)


@many
@given(rng=generators)
def test_a_slip_surface_stops_normal_motion_either_way(rng):
    _, tangent, new_normal, new_tangent = contact(rng, "slip", 0.0)
    np.testing.assert_allclose(new_normal, 0, atol=1e-14)
    np.testing.assert_allclose(new_tangent, tangent, atol=1e-12)


@many
@given(rng=generators)
def test_a_separating_surface_lets_go_and_never_lets_in(rng):
    normal, tangent, new_normal, new_tangent = contact(rng, "separate", 0.3)
    assert (new_normal > -1e-14).all()
    leaving = normal > 0
    np.testing.assert_allclose(new_normal[leaving], normal[leaving])
    np.testing.assert_allclose(new_tangent[leaving], tangent[leaving])


@pytest.mark.parametrize("law", ["slip", "separate"])
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


def course(data, t):
    """A motion of the schema, its displacements (3, n), rates (4, n) at times t (n,).

    The last rate is the speed of its surface.
    """
    motion = TypeAdapter(Kinematics).validate_python(data)
    shape = Box(type="box", center=(0.25, -0.5), size=(0.1, 0.2), angle_deg=10.0)
    thing = KinematicCollider.model_construct(shape=shape, kinematics=motion)
    if motion.type == "conveyor":
        return motion, np.zeros((3, len(t))), belt_of(thing, t)
    before, values = row(thing)
    code = ["def place(t):", *indented([*before, f"return {values}"], 4)]
    place = made("\n".join(code)).place
    x, y, cos, sin, *rate = np.array([place(time) for time in t.tolist()]).T
    turn = np.unwrap(np.arctan2(sin, cos)) - np.radians(10.0)
    moved = np.array([x - 0.25, y + 0.5, turn])
    return motion, moved, np.array([*rate, 0.0 * t])


def belt_of(thing, t):
    """Rates (4, n) of a belt."""
    code = belt(thing).replace("time[None]", "given")
    found = Particles([f"speed = {code}"], "speed", {"given": "float"}, "float")
    speeds = [found(given=part)["outcome"] for part in np.split(t, range(N, len(t), N))]
    return np.concatenate([np.zeros((3, len(t))), [np.concatenate(speeds)]])


def test_every_motion_of_the_schema_is_tested():
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
    np.testing.assert_allclose(moved[:, 0], 0, atol=1e-11)  # angles have 12 digits
    speed = np.diff(moved) / np.diff(TIMES)
    smooth = (abs(np.diff(rate)) < 0.02).all(0)
    assert smooth.sum() >= len(TIMES) - 3  # but for its start and its stop
    middle = 0.5 * (rate[:3, 1:] + rate[:3, :-1])
    np.testing.assert_allclose(speed[:, smooth], middle[:, smooth], atol=1e-4)


@motions
def test_a_motion_rests_before_its_start_and_after_its_stop(data):
    motion, moved, rate = course(data, TIMES)
    before, after = motion.start > TIMES, motion.stop <= TIMES
    np.testing.assert_allclose(moved[:, before], 0, atol=1e-11)
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
    np.testing.assert_allclose(course(data, TIMES)[1][:, -1], moved, atol=1e-11)


def test_an_oscillation_that_moves_nothing_is_refused():
    with pytest.raises(ValidationError, match="one of them must differ from 0"):
        course({"type": "oscillate", "frequency": 1.0}, TIMES)
