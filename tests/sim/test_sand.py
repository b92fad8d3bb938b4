"""Sand rests within its cone, dry, wet or flooded."""

import numpy as np
import pytest
import taichi as ti
from hypothesis import given

from mpmworlds.sim.physics.sand import cohesion, soak
from tests.sim.lab import N, deformations, generators, many, vectorised
from tests.sim.laws import BOND, LAM, MU, PHI, SAND


@ti.func
def _cohesion(r):
    return ti.Vector([cohesion(r[0], r[1])])


@ti.func
def _soak(r):
    return ti.Vector([soak(r[0], r[1], r[2])])


COHESION = vectorised(_cohesion, 1)
SOAK = vectorised(_soak, 1)


@pytest.mark.parametrize("bond", [0.0, BOND])
@many
@given(rng=generators)
def test_sand_is_on_its_cone_or_within(bond, rng):
    F = deformations(rng, 0.4, 1.5)
    found = SAND(F, rng.uniform(1.0, 1.2, N), bond)
    strength = bond * np.cos(PHI) - np.sin(PHI) * found.mean
    assert (found.shear <= strength + 1e-12).all()
    assert (found.q >= 1).all()
    parted = found.q > 1
    assert 10 < parted.sum() < N - 10
    np.testing.assert_allclose(found.mean[parted], bond / np.tan(PHI), atol=1e-12)
    np.testing.assert_allclose(found.shear[parted], 0, atol=1e-7)


@many
@given(rng=generators)
def test_sheared_sand_is_on_its_cone(rng):
    s = np.exp(rng.uniform(-0.5, -0.1, N))
    F = np.array([np.diag([4 * s, s / 4]) for s in s])
    found = SAND(F, 1.0, BOND)
    strength = BOND * np.cos(PHI) - np.sin(PHI) * found.mean
    np.testing.assert_allclose(found.shear, strength)


@pytest.mark.parametrize("bond", [0.0, BOND])
def test_parted_sand_resists_again_once_its_gain_of_volume_is_undone(bond):
    parted = SAND(1.05 * np.eye(2)[None], 1.0, bond)
    s = np.array([1.0, 0.96, 0.9])
    found = SAND(s[:, None, None] * parted.F, parted.q[0], bond)
    elastic = 2 * (MU + LAM) * np.log(1.05 * s)
    strength = bond / np.tan(PHI)
    np.testing.assert_allclose(found.mean, elastic.clip(max=strength), atol=1e-12)


def test_strength_of_wet_sand_in_tension_is_that_of_mohr_and_coulomb():
    found = SAND(np.array([1.5 * np.eye(2)]), 1.0, BOND)
    np.testing.assert_allclose(found.tau[0], BOND / np.tan(PHI) * np.eye(2))


def test_unconfined_strength_of_wet_sand_is_that_of_mohr_and_coulomb():
    mean = -BOND * np.cos(PHI) / (1 - np.sin(PHI))
    m = mean / (2 * (MU + LAM))
    found = SAND(np.array([np.diag(np.exp([m + 1, m - 1]))]), 1.0, BOND)
    np.testing.assert_allclose(found.tau[0], np.diag([0, 2 * mean]), atol=1e-12)


@pytest.mark.parametrize("saturation", [0.0, 1.0])
@many
@given(rng=generators)
def test_wet_sand_that_is_dry_or_flooded_is_sand(saturation, rng):
    F, q = deformations(rng, 0.4, 1.5), rng.uniform(1.0, 1.2, N)
    (bond,) = COHESION(np.array([saturation]), 7.0)
    wet, dry = SAND(F, q, bond[0]), SAND(F, q, 0.0)
    for one, other in ((wet.F, dry.F), (wet.q, dry.q), (wet.tau, dry.tau)):
        np.testing.assert_array_equal(one, other)


def test_cohesion_is_largest_at_half_saturation():
    saturation = np.linspace(0, 1, 101)
    (found,) = COHESION(saturation, 7.0)
    assert found.argmax() == 50
    assert found[50] == 7.0
    assert (found >= 0).all()
    np.testing.assert_allclose(found, found[::-1], atol=1e-12)


@many
@given(rng=generators)
def test_sand_soaks_up_to_full_where_there_is_water(rng):
    saturation, water = rng.uniform(0, 1, N), rng.uniform(0, 1.3, N)
    (found,) = SOAK(saturation, water, 1e-3)
    assert ((saturation <= found) & (found <= 1)).all()
    assert (found > saturation)[(saturation < 1) & (water > 0)].all()


def test_sand_without_water_near_keeps_its_moisture():
    saturation = np.linspace(0, 1, N)
    np.testing.assert_array_equal(SOAK(saturation, 0.0, 1e-3)[0], saturation)


@pytest.mark.parametrize(("water", "time"), [(1.0, 0.1), (0.25, 0.4), (1.2, 0.1)])
def test_pores_fill_within_a_tenth_of_a_second_of_full_contact(water, time):
    saturation = np.zeros(1)
    for _ in range(round(time / 1e-3)):
        (saturation,) = SOAK(saturation, water, 1e-3)
    assert saturation[0] == pytest.approx(1 - np.exp(-1), abs=2e-3)
