"""Fluids flow at the rate that their law says, in a homogeneous flow."""

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
from tests.sim.laws import LAM, MU, maxwell, paste

LIBRARY = functions(DT=1e-3)


@ti.func
def _overstress(r):
    return ti.Vector([LIBRARY.overstress(r[0], r[1], r[2], r[3])])


OVERSTRESS = vectorised(_overstress, 1)


def sheared(law, rates, dt, steps):
    """Shear stress (steps, n) of a law under constant rates of simple shear [1/s]."""
    gradient = np.asarray(rates)[:, None, None] * np.eye(2, k=1)
    F, q, tau = np.tile(np.eye(2), (len(gradient), 1, 1)), 1.0, []
    for _ in range(steps):
        found = law((np.eye(2) + dt * gradient) @ F, q)
        F, q = found.F, found.q
        tau.append(found.tau[:, 0, 1])
    return np.array(tau)


@pytest.mark.parametrize("n", [0.3, 0.5, 1.0, 2.0])
def test_steady_shear_stress_is_that_of_herschel_and_bulkley(n):
    rates, k, eta = np.array([0.05, 0.2, 0.5]), 2e-3, 4e-3

    def law(F, q):
        return paste(F, q, 1e-3, k, eta, n)

    tau = sheared(law, rates, 1e-3, 1000)
    np.testing.assert_allclose(tau[-1], k + eta * rates**n, rtol=5e-3)
    np.testing.assert_allclose(tau[-1], tau[-50], rtol=1e-3)


@pytest.mark.parametrize("n", [0.5, 1.0])
@many
@given(rng=generators)
def test_paste_below_its_yield_stress_never_relaxes(n, rng):
    F = deformations(rng, 0.9, 1.0)
    found = paste(F, 1.0, 1e9, 2 * MU * 0.06, 1e-3, n)
    np.testing.assert_allclose(found.F, F, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("n", [0.5, 1.0])
@many
@given(rng=generators)
def test_paste_at_rest_relaxes_to_its_yield_stress(n, rng):
    F, k = deformations(rng, 0.5, 1.0), 0.02
    start = paste(F, 1.0, 1e-12, k, 1.0, n).shear
    shear = [paste(F, 1.0, dt, k, 1.0, n).shear for dt in (0.1, 1.0, 10.0, 1e12)]
    flows = start > k
    assert flows.sum() > 10
    assert (np.diff([start, *shear], axis=0)[:, flows] < 0).all()
    np.testing.assert_allclose(shear[-1][flows], k, rtol=1e-3)


@many
@given(rng=generators)
def test_overstress_solves_its_equation_at_any_scale(rng):
    n = rng.choice([0.2, 0.3, 0.5, 0.8, 1.0, 1.5, 2.0], N)
    excess, drag, eta = (10.0 ** rng.uniform(-5, 5, N) for _ in range(3))
    (x,) = OVERSTRESS(excess, drag, eta, n)
    # x is the solution for an excess that differs where x is off by less than 0.2 %
    low, high = (f * x + drag * (f * x / eta) ** (1 / n) for f in (0.998, 1.002))
    assert ((low < excess) & (excess < high)).all()
    exact = n == 1.0
    closed = excess * eta / (eta + drag)
    np.testing.assert_allclose(x[exact], closed[exact], rtol=1e-12)


@many
@given(rng=generators)
def test_shear_of_a_maxwell_fluid_relaxes_and_pressure_stays(rng):
    F, time, steps = deformations(rng, 0.6, 1.0), 0.3, 60
    start = maxwell(F, 1.0, 1e-12, time)
    found = start
    for _ in range(steps):
        found = maxwell(found.F, found.q, 0.6 / steps, time)
    backward = (1 + 0.6 / steps / time) ** -steps  # Euler's for exp(-2)
    assert backward == pytest.approx(np.exp(-2), rel=0.04)
    np.testing.assert_allclose(found.shear, start.shear * backward, atol=1e-7)
    np.testing.assert_allclose(found.mean, start.mean, rtol=1e-6)


def test_slow_flow_of_a_maxwell_fluid_has_viscosity_mu_time():
    rates, time = np.array([0.02, 0.05, 0.1]), 0.1

    def law(F, q):
        return maxwell(F, q, 1e-4, time)

    tau = sheared(law, rates, 1e-4, 10000)
    np.testing.assert_allclose(tau[-1], MU * time * rates, rtol=2e-3)
    early = MU * time * rates * (1 - np.exp(-1))
    np.testing.assert_allclose(tau[999], early, rtol=2e-3)


@pytest.mark.parametrize("law", [paste, maxwell])
def test_fluids_bear_mean_tension_up_to_a_gain_of_a_tenth(law):
    s = np.linspace(0.8, 1.3, N)
    found = law(s[:, None, None] * np.eye(2))
    J = (s * s).clip(max=1.1)
    np.testing.assert_allclose(found.mean, 0.5 * (MU + LAM) * (J - 1 / J), atol=1e-12)


def settling(module):
    """Code by which a material settles, for particles whose surroundings are g full."""
    lines = code_of({f"{module}.settle": {}}, module, "settle")
    lines = [line.replace("g.w", "g") for line in lines]
    return Particles(lines, inputs={"g": "float"}, DT=1e-3)


SETTLE = settling("deformation")


@many
@given(rng=generators)
def test_settling_changes_volume_only_where_density_contradicts_it(rng):
    F, crowd = deformations(rng, 0.8, 1.2), rng.uniform(0.5, 1.5, N)
    kept = SETTLE(F=F, g=crowd)["F"]
    J = np.linalg.det(F)
    aim = np.where(crowd < 0.9, J.clip(min=1.0), J)
    aim = np.where(crowd > 1.1, np.minimum(J, (1 / crowd).clip(min=0.8)), aim)
    assert 10 < (aim == J).sum() < N - 10
    scale = np.sqrt(np.linalg.det(kept) / J)
    np.testing.assert_allclose(kept, scale[:, None, None] * F, rtol=1e-12)
    np.testing.assert_allclose(scale - 1, 0.1 * (aim / J - 1), atol=1e-12)
