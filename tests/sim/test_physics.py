"""Constitutive laws and contact hold their principles for any deformation."""

import numpy as np
import pytest
import taichi as ti
from hypothesis import given
from taichi.math import vec2

from mpmworlds.sim.physics.elastic import fixed_corotated, lame
from mpmworlds.sim.physics.liquid import compress, settle
from mpmworlds.sim.physics.sand import hencky_sand
from mpmworlds.sim.physics.snow import hardening, pack
from tests.sim.lab import (
    N,
    deformations,
    generators,
    many,
    matrix,
    pair,
    parts,
    symmetric,
    turns,
    vectorised,
)

MU, LAM = 1.0, 1.5
SIN_PHI = np.sin(np.radians(35.0))
STEP = 1e-6  # of finite differences


@ti.func
def _fixed_corotated(r):
    t, z = fixed_corotated(vec2(r[0], r[1]), vec2(r[2], r[3]), r[4], r[5])
    return ti.Vector([t, z.x, z.y])


@ti.func
def _hencky_sand(r):
    a, b, q, t, z = hencky_sand(
        vec2(r[0], r[1]), vec2(r[2], r[3]), r[4], r[5], r[6], r[7]
    )
    return ti.Vector([a.x, a.y, b.x, b.y, q, t, z.x, z.y])


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


COROTATED = vectorised(_fixed_corotated, 3)
HENCKY_SAND = vectorised(_hencky_sand, 8)
PACK = vectorised(_pack, 5)
LAME = vectorised(_lame, 2)
HARDENING = vectorised(_hardening, 1)
COMPRESS = vectorised(_compress, 2)
SETTLE = vectorised(_settle, 1)


def stress_corotated(F):
    return symmetric(*COROTATED(*parts(*pair(F)), MU, LAM))


def stress_sand(F):
    return symmetric(*HENCKY_SAND(*parts(*pair(F)), 1.0, MU, LAM, SIN_PHI)[5:])


def energy_corotated(F):
    """mu |F - R|^2 + lam (J - 1)^2 / 2."""
    s = np.linalg.svd(F, compute_uv=False)
    return MU * ((s - 1) ** 2).sum(-1) + 0.5 * LAM * (s.prod(-1) - 1) ** 2


def energy_hencky(F):
    """mu |e|^2 + lam (tr e)^2 / 2 of the logarithmic strains e."""
    e = np.log(np.linalg.svd(F, compute_uv=False))
    return MU * (e**2).sum(-1) + 0.5 * LAM * e.sum(-1) ** 2


def in_the_cone(rng):
    """Random F at which sand is elastic: compressed, and hardly sheared."""
    left, right = (turns(rng.uniform(0, 2 * np.pi, N)) for _ in range(2))
    m = rng.uniform(-0.4, -0.1, N)
    g = rng.uniform(-0.9, 0.9, N) * SIN_PHI * (LAM + MU) / MU * -m
    s = np.exp(np.stack([m + g, m - g], axis=1))
    return left @ (s[:, :, None] * np.eye(2)) @ right


def work_conjugate(energy, F):
    """(d energy / dF) F^T by central differences, (N, 2, 2)."""
    P = np.zeros_like(F)
    for i, j in np.ndindex(2, 2):
        dF = np.zeros((2, 2))
        dF[i, j] = STEP
        P[:, i, j] = (energy(F + dF) - energy(F - dF)) / (2 * STEP)
    return P @ F.transpose(0, 2, 1)


LAWS = pytest.mark.parametrize(
    ("stress", "energy", "draw"),
    [
        (stress_corotated, energy_corotated, lambda r: deformations(r, 0.5, 1.6)),
        (stress_sand, energy_hencky, in_the_cone),
    ],
    ids=["fixed corotated", "hencky"],
)


@LAWS
@many
@given(rng=generators)
def test_stress_is_conjugate_to_its_energy(stress, energy, draw, rng):
    F = draw(rng)
    np.testing.assert_allclose(stress(F), work_conjugate(energy, F), atol=1e-8)


@pytest.mark.parametrize("stress", [stress_corotated, stress_sand])
@many
@given(rng=generators)
def test_stress_is_objective_and_isotropic(stress, rng):
    F = deformations(rng, 0.5, 1.6)
    Q, R = (turns(rng.uniform(0, 2 * np.pi, N)) for _ in range(2))
    rotated = Q @ stress(F) @ Q.transpose(0, 2, 1)
    np.testing.assert_allclose(stress(Q @ F @ R), rotated, atol=1e-12)


@pytest.mark.parametrize("stress", [stress_corotated, stress_sand])
def test_rotations_are_free_of_stress(stress):
    rotations = turns(np.linspace(0, 2 * np.pi, N))
    np.testing.assert_allclose(stress(rotations), 0, atol=1e-14)


@pytest.mark.parametrize("stress", [stress_corotated, stress_sand])
def test_stress_is_linear_elastic_at_small_strain(stress):
    strain = 1e-7 * np.array([[[-2.0, 0.3], [0.3, -1.5]]])
    linear = 2 * MU * strain + LAM * np.trace(strain[0]) * np.eye(2)
    np.testing.assert_allclose(stress(np.eye(2) + strain), linear, rtol=1e-5)


@many
@given(rng=generators)
def test_sand_is_on_its_cone_or_within(rng):
    F = deformations(rng, 0.4, 1.5)
    a_x, a_y, b_x, b_y, q, t, z_x, z_y = HENCKY_SAND(
        *parts(*pair(F)), rng.uniform(1.0, 1.2, N), MU, LAM, SIN_PHI
    )
    assert (np.hypot(z_x, z_y) <= -SIN_PHI * t + 1e-12).all()
    assert (q >= 1).all()
    loose = q > 1
    assert 10 < loose.sum() < N - 10
    np.testing.assert_allclose(t[loose], 0, atol=1e-12)
    kept = matrix(a_x + 1j * a_y, b_x + 1j * b_y)
    np.testing.assert_allclose(
        symmetric(t, z_x, z_y), work_conjugate(energy_hencky, kept), atol=1e-8
    )


@many
@given(rng=generators)
def test_yielding_sand_keeps_its_principal_axes_and_mean_strain(rng):
    F = deformations(rng, 0.4, 0.9)
    found = HENCKY_SAND(*parts(*pair(F)), 1.0, MU, LAM, SIN_PHI)
    kept = matrix(found[0] + 1j * found[1], found[2] + 1j * found[3])
    np.testing.assert_allclose(np.linalg.det(kept), np.linalg.det(F), rtol=1e-12)
    U, _, V = np.linalg.svd(F)
    rest = U.transpose(0, 2, 1) @ kept @ V.transpose(0, 2, 1)
    np.testing.assert_allclose(rest[:, [0, 1], [1, 0]], 0, atol=1e-12)


@many
@given(rng=generators)
def test_return_mapping_of_sand_is_a_projection(rng):
    F = deformations(rng, 0.4, 1.5)
    first = HENCKY_SAND(*parts(*pair(F)), 1.0, MU, LAM, SIN_PHI)
    again = HENCKY_SAND(*first[:5], MU, LAM, SIN_PHI)
    np.testing.assert_allclose(again, first, atol=1e-12)


def test_expanded_sand_resists_again_once_its_gain_of_volume_is_undone():
    q = HENCKY_SAND(*parts(*pair(1.05 * np.eye(2)[None])), 1.0, MU, LAM, SIN_PHI)[4]
    s = np.array([1.0, 0.96, 0.9])
    F = s[:, None, None] * np.eye(2)
    t = HENCKY_SAND(*parts(*pair(F)), q[0], MU, LAM, SIN_PHI)[5]
    pressed = 2 * (MU + LAM) * np.log(1.05 * s).clip(max=0)
    np.testing.assert_allclose(t, pressed, atol=1e-12)


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
