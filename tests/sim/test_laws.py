"""What every constitutive law holds, for any deformation."""

import numpy as np
import pytest
from hypothesis import given

from tests.sim.lab import N, deformations, generators, many, turns
from tests.sim.laws import (
    ENERGIES,
    FLOWING,
    HARDENED,
    INSTANT,
    LAM,
    LAWS,
    MU,
    OTHERS,
    YIELDING,
    paste,
    plastic,
    pressed,
    work_conjugate,
)


def each(laws):
    return pytest.mark.parametrize("law", laws.values(), ids=laws)


def log_strains(F):
    """Principal log strains (n, 2), the larger first."""
    return np.log(np.linalg.svd(F, compute_uv=False))


def test_the_energy_of_every_law_of_the_schema_is_known():
    assert ENERGIES.keys() | HARDENED == LAWS.keys()


@pytest.mark.parametrize("name", ENERGIES)
@many
@given(rng=generators)
def test_stress_is_conjugate_to_the_energy_of_the_strain_that_is_kept(name, rng):
    found = LAWS[name](deformations(rng, 0.5, 1.6))
    expected = work_conjugate(ENERGIES[name], found.F)
    np.testing.assert_allclose(found.tau, expected, atol=5e-8)


@each(LAWS)
@many
@given(rng=generators)
def test_laws_are_objective_and_isotropic(law, rng):
    F = deformations(rng, 0.5, 1.6)
    Q, R = (turns(rng.uniform(0, 2 * np.pi, N)) for _ in range(2))
    one, turned = law(F), law(Q @ F @ R)
    rotated = Q @ one.tau @ Q.transpose(0, 2, 1)
    np.testing.assert_allclose(turned.tau, rotated, atol=1e-7)
    np.testing.assert_allclose(turned.F, Q @ one.F @ R, atol=1e-8)
    for name, values in one.states.items():
        np.testing.assert_allclose(turned.states[name], values, atol=1e-8)


@each(LAWS)
def test_rotations_are_free_of_stress(law):
    F = turns(np.linspace(0, 2 * np.pi, N))
    found = law(F)
    np.testing.assert_allclose(found.tau, 0, atol=1e-8)
    np.testing.assert_allclose(found.F, F, atol=1e-8)
    for values in found.states.values():
        np.testing.assert_allclose(values, values[0], atol=1e-12)


@each({name: law for name, law in LAWS.items() if name != "viscoelastic"})
def test_laws_are_linear_elastic_at_small_strain(law):
    strain = 1e-5 * np.array([[[-2.0, 0.3], [0.3, -1.5]]])
    linear = 2 * MU * strain + LAM * np.trace(strain[0]) * np.eye(2)
    np.testing.assert_allclose(law(np.eye(2) + strain).tau, linear, rtol=1e-3)


@each(LAWS)
def test_collapsed_inverted_and_overstretched_matter_has_finite_stress(law):
    flat, mirror, long = np.diag([1.0, 0.0]), np.diag([1.0, -1.0]), np.diag([9.0, 0.1])
    found = law(np.array([np.zeros((2, 2)), 1e-9 * np.eye(2), flat, mirror, long]))
    for values in (found.F, found.tau, *found.states.values()):
        assert np.isfinite(values).all()


@each(OTHERS)
@many
@given(rng=generators)
def test_laws_without_flow_keep_the_strain_or_yield(law, rng):
    F = deformations(rng, 0.998, 1.002)
    np.testing.assert_allclose(law(F).F, F, atol=1e-8)


@each(YIELDING)
@many
@given(rng=generators)
def test_flow_never_gives_back_work(law, rng):
    F = deformations(rng, 0.5, 1.6)
    found = law(F)
    lost = log_strains(F) - log_strains(found.F)
    power = found.mean * lost.sum(1) + found.shear * (lost[:, 0] - lost[:, 1])
    assert (power > -1e-8).all()
    assert (power > 1e-3).sum() > 10


@each(LAWS)
@many
@given(rng=generators)
def test_flow_keeps_principal_axes_and_turns_nothing(law, rng):
    F = deformations(rng, 0.4, 1.5)
    U, _, V = np.linalg.svd(F)
    rest = U.transpose(0, 2, 1) @ law(F).F @ V.transpose(0, 2, 1)
    np.testing.assert_allclose(rest[:, [0, 1], [1, 0]], 0, atol=1e-8)
    assert (rest[:, [0, 1], [0, 1]] > 0).all()


@each(YIELDING)
@many
@given(rng=generators)
def test_flow_under_pressure_keeps_volume(law, rng):
    F = deformations(rng, 0.4, 0.95)
    found, J = law(F), np.linalg.det(F)
    np.testing.assert_allclose(np.linalg.det(found.F), J, rtol=1e-8)
    np.testing.assert_allclose(found.mean, pressed(J), rtol=1e-8)


@each(INSTANT)
@many
@given(rng=generators)
def test_return_mapping_without_time_is_a_projection(law, rng):
    first = law(deformations(rng, 0.4, 1.5))
    again = law(first.F, first.q) if first.states else law(first.F)
    np.testing.assert_allclose(again.F, first.F, atol=1e-8)
    np.testing.assert_allclose(again.tau, first.tau, atol=1e-7)
    for name, values in first.states.items():
        np.testing.assert_allclose(again.states[name], values, atol=1e-8)


@each(FLOWING)
def test_gain_of_volume_beyond_a_tenth_is_undone_before_a_fluid_resists_again(law):
    parted = law(1.3 * np.eye(2)[None])
    s = np.array([1.0, 0.95, 0.9, 0.8, 0.7])
    found = law(s[:, None, None] * parted.F, parted.q[0])
    total = (1.3 * s) ** 2
    np.testing.assert_allclose(found.mean, pressed(total.clip(max=1.1)), rtol=1e-8)
    np.testing.assert_allclose(np.linalg.det(found.F) * found.q, total, rtol=1e-8)


@many
@given(rng=generators)
def test_thick_paste_is_elastic_and_thin_paste_is_plastic(rng):
    F = deformations(rng, 0.5, 0.95)
    elastic, yielded = log_strains(F), plastic(F)
    for n in (0.3, 0.5, 1.0, 2.0):
        thick, thin = (paste(F, eta=eta, n=n) for eta in (1e12, 1e-12))
        np.testing.assert_allclose(log_strains(thick.F), elastic, atol=1e-6)
        np.testing.assert_allclose(thin.tau, yielded.tau, atol=1e-6)


def test_laws_are_those_of_hencky_up_to_moderate_strain():
    volume = np.linspace(-0.35, 0.35, N)
    found = plastic(np.exp(0.5 * volume)[:, None, None] * np.eye(2))
    np.testing.assert_allclose(found.mean, (MU + LAM) * volume, rtol=0.022)
    shear = np.linspace(0.01, 0.09, N)  # of log strain, below the yield stress
    found = plastic(np.array([np.diag([np.exp(e), np.exp(-e)]) for e in shear]))
    np.testing.assert_allclose(found.shear, 2 * MU * shear, rtol=0.022)
