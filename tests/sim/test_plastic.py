"""Plastic solids yield at their yield stress, and harden."""

import numpy as np
import pytest
from hypothesis import given

from tests.sim.lab import N, deformations, generators, many
from tests.sim.laws import MU, SLOPE, YIELD, law, plastic

SLOPES = pytest.mark.parametrize("slope", [0.0, SLOPE])


def shear(F):
    """tanh of half the difference of the principal log strains (n,)."""
    s = np.linalg.svd(F, compute_uv=False)
    return (s[:, 0] - s[:, 1]) / (s[:, 0] + s[:, 1])


def slip(found):
    """Plastic shear strain (n,), 0 for a solid that does not harden."""
    return found.states.get("slip", np.zeros(N))


@SLOPES
@many
@given(rng=generators)
def test_shear_stress_is_at_most_the_hardened_yield_stress(slope, rng):
    F, q = deformations(rng, 0.6, 1.6), rng.uniform(0.0, 0.3, N)
    found = plastic(F, q, slope)
    strength = YIELD + slope * slip(found)
    assert (found.shear <= strength + 1e-8).all()
    yields = 2 * MU * shear(F) > YIELD + slope * q
    assert 10 < yields.sum() < N - 10
    np.testing.assert_allclose(found.shear[yields], strength[yields])
    np.testing.assert_allclose(found.F[~yields], F[~yields], atol=1e-8)


@many
@given(rng=generators)
def test_plastic_shear_strain_is_what_the_elastic_strain_lost(rng):
    F, q = deformations(rng, 0.6, 1.6), rng.uniform(0.0, 0.3, N)
    found = plastic(F, q, SLOPE)
    lost = 2 * (shear(F) - shear(found.F))
    np.testing.assert_allclose(found.q - q, lost, atol=1e-8)
    assert (found.q >= q).all()


def test_hardening_raises_stress_at_the_plastic_tangent_in_simple_shear():
    tau, q, F = [], 0.0, np.eye(2)[None]
    k, slope, step = 0.01, 0.05, 1e-4
    hardens = law("plastic", yield_stress=k, hardening_modulus=slope)
    for _ in range(600):
        F = (np.eye(2) + step * np.eye(2, k=1)) @ F
        found = hardens(F, q)
        F, q = found.F, found.q
        tau.append(found.tau[0, 0, 1])
    rate = np.gradient(tau, step)
    assert rate[20] == pytest.approx(MU, rel=1e-3)
    assert rate[-20] == pytest.approx(MU * slope / (MU + slope), rel=1e-2)
