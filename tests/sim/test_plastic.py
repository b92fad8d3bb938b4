"""Plastic solids yield at their yield stress, and harden."""

import numpy as np
import pytest
from hypothesis import given

from tests.sim.lab import N, deformations, generators, many
from tests.sim.laws import MU, PLASTIC, SLOPE, YIELD

SLOPES = pytest.mark.parametrize("slope", [0.0, SLOPE])


def half_difference(F):
    """Half difference of the principal log strains (n,)."""
    e = np.log(np.linalg.svd(F, compute_uv=False))
    return 0.5 * (e[:, 0] - e[:, 1])


@SLOPES
@many
@given(rng=generators)
def test_shear_stress_is_at_most_the_hardened_yield_stress(slope, rng):
    F, q = deformations(rng, 0.6, 1.6), rng.uniform(1.0, 1.3, N)
    found = PLASTIC(F, q, YIELD, slope)
    strength = YIELD + slope * (found.q - 1)
    assert (found.shear <= strength + 1e-12).all()
    yields = 2 * MU * half_difference(F) > YIELD + slope * (q - 1)
    assert 10 < yields.sum() < N - 10
    np.testing.assert_allclose(found.shear[yields], strength[yields])
    np.testing.assert_allclose(found.F[~yields], F[~yields], atol=1e-14)


@SLOPES
@many
@given(rng=generators)
def test_plastic_shear_strain_is_what_the_elastic_strain_lost(slope, rng):
    F, q = deformations(rng, 0.6, 1.6), rng.uniform(1.0, 1.3, N)
    found = PLASTIC(F, q, YIELD, slope)
    lost = 2 * (half_difference(F) - half_difference(found.F))
    np.testing.assert_allclose(found.q - q, lost, atol=1e-12)
    assert (found.q >= q).all()


def test_hardening_raises_stress_at_the_plastic_tangent_in_simple_shear():
    tau, q, F = [], 1.0, np.eye(2)[None]
    k, slope, step = 0.01, 0.05, 1e-4
    for _ in range(600):
        F = (np.eye(2) + step * np.eye(2, k=1)) @ F
        found = PLASTIC(F, q, k, slope)
        F, q = found.F, found.q
        tau.append(found.tau[0, 0, 1])
    rate = np.gradient(tau, step)
    assert rate[20] == pytest.approx(MU, rel=1e-3)
    assert rate[-20] == pytest.approx(MU * slope / (MU + slope), rel=1e-2)
