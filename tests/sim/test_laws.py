"""What every constitutive law holds, for any deformation."""

import numpy as np
import pytest
from hypothesis import given

from tests.sim.lab import N, deformations, generators, many, turns
from tests.sim.laws import (
    FLOWING,
    HENCKY,
    INSTANT,
    LAM,
    LAWS,
    MU,
    PASTE,
    energy_corotated,
    energy_hencky,
    work_conjugate,
)


def each(laws):
    return pytest.mark.parametrize("law", laws.values(), ids=laws)


def log_strains(F):
    """Principal log strains (n, 2), the larger first."""
    return np.log(np.linalg.svd(F, compute_uv=False))


@pytest.mark.parametrize("name", LAWS)
@many
@given(rng=generators)
def test_stress_is_conjugate_to_the_energy_of_the_strain_that_is_kept(name, rng):
    energy = energy_corotated if name == "corotated" else energy_hencky
    found = LAWS[name](deformations(rng, 0.5, 1.6))
    np.testing.assert_allclose(found.tau, work_conjugate(energy, found.F), atol=1e-8)


@each(LAWS)
@many
@given(rng=generators)
def test_laws_are_objective_and_isotropic(law, rng):
    F = deformations(rng, 0.5, 1.6)
    Q, R = (turns(rng.uniform(0, 2 * np.pi, N)) for _ in range(2))
    one, turned = law(F), law(Q @ F @ R)
    rotated = Q @ one.tau @ Q.transpose(0, 2, 1)
    np.testing.assert_allclose(turned.tau, rotated, atol=1e-12)
    np.testing.assert_allclose(turned.F, Q @ one.F @ R, atol=1e-12)
    np.testing.assert_allclose(turned.q, one.q, atol=1e-12)


@each(LAWS)
def test_rotations_are_free_of_stress(law):
    found = law(turns(np.linspace(0, 2 * np.pi, N)))
    np.testing.assert_allclose(found.tau, 0, atol=1e-14)
    np.testing.assert_allclose(found.q, 1, atol=1e-14)


@each({name: law for name, law in LAWS.items() if name != "maxwell"})
def test_laws_are_linear_elastic_at_small_strain(law):
    strain = 1e-7 * np.array([[[-2.0, 0.3], [0.3, -1.5]]])
    linear = 2 * MU * strain + LAM * np.trace(strain[0]) * np.eye(2)
    np.testing.assert_allclose(law(np.eye(2) + strain).tau, linear, rtol=1e-5)


@each(LAWS)
def test_collapsed_inverted_and_overstretched_matter_has_finite_stress(law):
    flat, mirror, long = np.diag([1.0, 0.0]), np.diag([1.0, -1.0]), np.diag([9.0, 0.1])
    found = law(np.array([np.zeros((2, 2)), 1e-9 * np.eye(2), flat, mirror, long]))
    for values in (found.F, found.q, found.tau):
        assert np.isfinite(values).all()


@each(HENCKY)
@many
@given(rng=generators)
def test_flow_never_gives_back_work(law, rng):
    F = deformations(rng, 0.5, 1.6)
    found = law(F)
    lost = log_strains(F) - log_strains(found.F)
    power = found.mean * lost.sum(1) + found.shear * (lost[:, 0] - lost[:, 1])
    assert (power > -1e-12).all()
    assert (power > 1e-3).sum() > 10


@each(HENCKY)
@many
@given(rng=generators)
def test_flow_keeps_principal_axes_and_turns_nothing(law, rng):
    F = deformations(rng, 0.4, 1.5)
    U, _, V = np.linalg.svd(F)
    rest = U.transpose(0, 2, 1) @ law(F).F @ V.transpose(0, 2, 1)
    np.testing.assert_allclose(rest[:, [0, 1], [1, 0]], 0, atol=1e-12)
    assert (rest[:, [0, 1], [0, 1]] > 0).all()


@each(HENCKY)
@many
@given(rng=generators)
def test_flow_under_pressure_keeps_volume(law, rng):
    F = deformations(rng, 0.4, 0.95)
    found = law(F)
    np.testing.assert_allclose(np.linalg.det(found.F), np.linalg.det(F), rtol=1e-12)
    pressed = 2 * (MU + LAM) * log_strains(F).mean(1)
    np.testing.assert_allclose(found.mean, pressed, rtol=1e-10)


@each(INSTANT)
@many
@given(rng=generators)
def test_return_mapping_without_time_is_a_projection(law, rng):
    first = law(deformations(rng, 0.4, 1.5))
    again = law(first.F, first.q)
    np.testing.assert_allclose(again.F, first.F, atol=1e-12)
    np.testing.assert_allclose(again.q, first.q, atol=1e-12)
    np.testing.assert_allclose(again.tau, first.tau, atol=1e-11)


@each(FLOWING)
def test_gain_of_volume_beyond_a_tenth_is_undone_before_a_fluid_resists_again(law):
    parted = law(1.3 * np.eye(2)[None])
    s = np.array([1.0, 0.95, 0.9, 0.8, 0.7])
    found = law(s[:, None, None] * parted.F, parted.q[0])
    total = np.log(1.3 * s)
    np.testing.assert_allclose(found.mean, 2 * (MU + LAM) * total.clip(max=0.05))
    gained = np.log(np.linalg.det(found.F)) + found.q - 1
    np.testing.assert_allclose(gained, 2 * total, atol=1e-12)


@many
@given(rng=generators)
def test_thick_paste_is_elastic_and_thin_paste_is_plastic(rng):
    F = deformations(rng, 0.5, 0.95)
    elastic, plastic = log_strains(F), INSTANT["plastic"](F)
    for n in (0.3, 0.5, 1.0, 2.0):
        thick, thin = (PASTE(F, 1.0, 1.0, 0.2, eta, n) for eta in (1e12, 1e-12))
        np.testing.assert_allclose(log_strains(thick.F), elastic, atol=1e-6)
        np.testing.assert_allclose(thin.tau, plastic.tau, atol=1e-6)
