"""Snow packs and hardens; liquids hold their volume; moduli mean what they say."""

import numpy as np
import pytest
import taichi as ti
from hypothesis import given
from taichi.math import vec2

from mpmworlds.sim.physics.elastic import lame
from mpmworlds.sim.physics.liquid import compress, settle
from mpmworlds.sim.physics.snow import hardening, pack
from tests.sim.lab import (
    N,
    deformations,
    generators,
    many,
    matrix,
    pair,
    parts,
    vectorised,
)

STEP = 1e-6  # of finite differences


@ti.func
def _pack(r):
    a, b, Jp = pack(vec2(r[0], r[1]), vec2(r[2], r[3]), r[4], r[5], r[6])
    return ti.Vector([a.x, a.y, b.x, b.y, Jp])


@ti.func
def _lame(r):
    mu, lam = lame(r[0], r[1])
    return ti.Vector([mu, lam])


@ti.func
def _hardening(r):
    return ti.Vector([hardening(r[0], r[1], r[2], r[3])])


@ti.func
def _compress(r):
    J, t = compress(r[0], vec2(r[1], r[2]), r[3], r[4])
    return ti.Vector([J, t])


@ti.func
def _settle(r):
    return ti.Vector([settle(r[0], r[1], r[2])])


PACK = vectorised(_pack, 5)
LAME = vectorised(_lame, 2)
HARDENING = vectorised(_hardening, 1)
COMPRESS = vectorised(_compress, 2)
SETTLE = vectorised(_settle, 1)


@many
@given(rng=generators)
def test_packed_snow_is_within_its_yield_surface_and_keeps_its_volume(rng):
    F, Jp = deformations(rng, 0.9, 1.1), rng.uniform(0.8, 1.2, N)
    *kept, new_Jp = PACK(*parts(*pair(F)), Jp, 0.025, 0.005)
    kept = matrix(kept[0] + 1j * kept[1], kept[2] + 1j * kept[3])
    s = np.linalg.svd(kept, compute_uv=False)
    expected = np.linalg.svd(F, compute_uv=False).clip(0.975, 1.005)
    np.testing.assert_allclose(s, expected, rtol=1e-12)
    np.testing.assert_allclose(s.prod(-1) * new_Jp, np.linalg.det(F) * Jp, rtol=1e-12)


@many
@given(rng=generators)
def test_packing_of_snow_is_a_projection(rng):
    F = deformations(rng, 0.3, 2.0)
    first = PACK(*parts(*pair(F)), 1.0, 0.025, 0.005)
    np.testing.assert_allclose(PACK(*first, 0.025, 0.005), first, atol=1e-12)


def test_snow_hardens_under_compaction_between_its_bounds():
    Jp = np.linspace(0.6, 2.0, N)
    (h,) = HARDENING(Jp, 10.0, 0.1, 5.0)
    assert (np.diff(h) <= 0).all()
    assert (h.min(), h.max()) == (0.1, 5.0)
    assert HARDENING(np.ones(1), 10.0, 0.1, 5.0)[0] == 1


@many
@given(rng=generators)
def test_lame_parameters_give_back_modulus_and_ratio(rng):
    E, nu = rng.uniform(1, 1e6, N), rng.uniform(0, 0.45, N)
    mu, lam = LAME(E, nu)
    np.testing.assert_allclose(mu * (3 * lam + 2 * mu) / (lam + mu), E)
    np.testing.assert_allclose(lam / (2 * (lam + mu)), nu, atol=1e-12)


def test_pressure_of_a_liquid_rises_with_its_bulk_modulus():
    J, t = COMPRESS(np.array([1.0, 1.0 - STEP]), 0.0, 0.0, 0.0, 400.0)
    pressure = -t / J
    assert pressure[0] == 0
    assert (pressure[1] - pressure[0]) / STEP == pytest.approx(400, rel=1e-4)


def test_a_liquid_bears_no_tension():
    _, t = COMPRESS(np.linspace(1.0, 1.1, N), 0.0, 0.0, 0.0, 400.0)
    assert (t == 0).all()


@many
@given(rng=generators)
def test_volume_of_a_liquid_follows_the_divergence(rng):
    C, J = rng.normal(size=(N, 2, 2)), rng.uniform(0.8, 1.0, N)
    c, _ = pair(C)
    new_J, _ = COMPRESS(J, *parts(c), 1e-3, 400.0)
    divergence = np.trace(C, axis1=1, axis2=2)
    np.testing.assert_allclose(new_J, J * (1 + 1e-3 * divergence))


@many
@given(rng=generators)
def test_settling_moves_volume_towards_what_the_density_says(rng):
    J, crowd = rng.uniform(0.6, 1.1, N), rng.uniform(0.05, 2.0, N)
    (settled,) = SETTLE(J, crowd, 1e-3)
    far = abs(crowd - 1) > 0.1
    aim = (1 / crowd).clip(0.8, 1.1)
    np.testing.assert_array_equal(settled[~far], J[~far])
    np.testing.assert_allclose((settled - aim)[far], 0.8 * (J - aim)[far], atol=1e-12)
