"""Sand rests within its cone, dry, wet or flooded."""

import numpy as np
import pytest
import taichi as ti
from hypothesis import given

from tests.sim.lab import (
    N,
    Particles,
    code_of,
    deformations,
    functions,
    generators,
    many,
    vectorised,
)
from tests.sim.laws import BOND, COS, LAM, MU, SAND, SIN, law, pressed, wet

LIBRARY = functions(DT=1e-3)


@ti.func
def _cohesion(r):
    return ti.Vector([LIBRARY.cohesion(r[0], r[1])])


COHESION = vectorised(_cohesion, 1)
BONDED = pytest.mark.parametrize(("law", "bond"), [(SAND, 0.0), (wet, BOND)])


@BONDED
@many
@given(rng=generators)
def test_sand_is_on_its_cone_or_within(law, bond, rng):
    F = deformations(rng, 0.4, 1.5)
    found = law(F, rng.uniform(1.0, 1.2, N))
    strength = bond * COS - SIN * found.mean
    assert (found.shear <= strength + 1e-9).all()
    assert (found.q >= 1).all()
    parted = found.q > 1
    assert 10 < parted.sum() < N - 10
    np.testing.assert_allclose(found.mean[parted], bond * COS / SIN, atol=1e-12)
    np.testing.assert_allclose(found.shear[parted], 0, atol=1e-7)


@many
@given(rng=generators)
def test_sheared_sand_is_on_its_cone(rng):
    s = np.exp(rng.uniform(-0.4, -0.1, N))  # 2 mu bounds all shear of the law
    found = wet(np.array([np.diag([4 * s, s / 4]) for s in s]))
    np.testing.assert_allclose(found.shear, BOND * COS - SIN * found.mean, rtol=1e-6)


@BONDED
def test_parted_sand_resists_again_once_its_gain_of_volume_is_undone(law, bond):
    parted = law(1.05 * np.eye(2)[None])
    s = np.array([1.0, 0.96, 0.9])
    found = law(s[:, None, None] * parted.F, parted.q[0])
    elastic, strength = pressed((1.05 * s) ** 2), bond * COS / SIN
    np.testing.assert_allclose(found.mean, elastic.clip(max=strength), atol=1e-8)


def test_strength_of_wet_sand_in_tension_is_that_of_mohr_and_coulomb():
    found = wet(np.array([1.5 * np.eye(2)]))
    np.testing.assert_allclose(found.tau[0], BOND * COS / SIN * np.eye(2))


def test_unconfined_strength_of_wet_sand_is_that_of_mohr_and_coulomb():
    mean = -BOND * COS / (1 - SIN)
    half = mean / (MU + LAM)
    J = half + np.sqrt(1 + half**2)  # where the mean stress is that
    found = wet(np.array([np.diag([np.sqrt(J) * np.e, np.sqrt(J) / np.e])]))
    np.testing.assert_allclose(found.tau[0], np.diag([0, 2 * mean]), atol=1e-8)


@pytest.mark.parametrize("saturation", [0.0, 1.0])
@many
@given(rng=generators)
def test_wet_sand_that_is_dry_or_flooded_is_sand(saturation, rng):
    F, q = deformations(rng, 0.4, 1.5), rng.uniform(1.0, 1.2, N)
    sodden = law("wet_sand", cohesion=BOND, friction_angle_deg=35.0)
    one, other = sodden(F, q, saturation=saturation), SAND(F, q)
    for a, b in ((one.F, other.F), (one.q, other.q), (one.tau, other.tau)):
        np.testing.assert_array_equal(a, b)


def test_cohesion_is_largest_at_half_saturation():
    saturation = np.linspace(0, 1, 101)
    (found,) = COHESION(saturation, 7.0)
    assert found.argmax() == 50
    assert found[50] == 7.0
    assert (found >= 0).all()
    np.testing.assert_allclose(found, found[::-1], atol=1e-12)


SOAKING = [
    line.replace("w[i].x * w[j].y * water[base.x + i, base.y + j] / DX**2", "near / 9")
    for line in code_of({"soak": {}}, "wet_sand", "settle")
]
SOAK = Particles(SOAKING, inputs={"near": "float"}, DT=1e-3)


def soaked(saturation, water):
    """Saturation after a step beside so much water, a part of the pores."""
    return SOAK(saturation=saturation, near=water)["saturation"]


@many
@given(rng=generators)
def test_sand_soaks_up_to_full_where_there_is_water(rng):
    saturation, water = rng.uniform(0, 1, N), rng.uniform(0, 1.3, N)
    found = soaked(saturation, water)
    assert ((saturation <= found) & (found <= 1)).all()
    assert (found > saturation)[(saturation < 1) & (water > 0)].all()


def test_sand_without_water_near_keeps_its_moisture():
    saturation = np.linspace(0, 1, N)
    np.testing.assert_array_equal(soaked(saturation, 0.0), saturation)


@pytest.mark.parametrize(("water", "time"), [(1.0, 0.1), (0.25, 0.4), (1.2, 0.1)])
def test_pores_fill_within_a_tenth_of_a_second_of_full_contact(water, time):
    saturation = np.zeros(1)
    for _ in range(round(time / 1e-3)):
        saturation = soaked(saturation, water)
    assert saturation[0] == pytest.approx(1 - np.exp(-1), abs=2e-3)
