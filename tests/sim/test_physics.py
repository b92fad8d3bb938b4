"""Snow packs and hardens; liquids hold their volume; moduli mean what they say."""

import numpy as np
import pytest
from hypothesis import given

from mpmworlds.sim.scene.objects import MATERIALS
from tests.sim.lab import N, Particles, code_of, deformations, generators, many
from tests.sim.laws import law
from tests.sim.test_visco import settling

STEP = 1e-6  # of finite differences
SNOW = law("snow")
PRESS, PULL = 0.025, 0.005  # critical compression and stretch


def liquid(bulk_modulus=400.0, viscosity=0.0, dt=1e-3):
    """Law of a liquid: J, C -> fields after a step."""
    given = {"constitutive_model": "liquid", "density": 1.0}
    given |= {"bulk_modulus": bulk_modulus, "viscosity": viscosity}
    hooks = MATERIALS["liquid"].model_construct(**given).hooks(frozenset({"liquid"}))
    return Particles(code_of(hooks, "liquid", "stress"), DT=dt)


@many
@given(rng=generators)
def test_packed_snow_is_within_its_yield_surface_and_keeps_its_volume(rng):
    F, Jp = deformations(rng, 0.9, 1.1), rng.uniform(0.8, 1.2, N)
    found = SNOW(F, Jp)
    s = np.linalg.svd(found.F, compute_uv=False)
    expected = np.linalg.svd(F, compute_uv=False).clip(1 - PRESS, 1 + PULL)
    np.testing.assert_allclose(s, expected, rtol=1e-8)
    np.testing.assert_allclose(s.prod(-1) * found.q, np.linalg.det(F) * Jp, rtol=1e-8)


@many
@given(rng=generators)
def test_packing_of_snow_is_a_projection(rng):
    first = SNOW(deformations(rng, 0.3, 2.0))
    again = SNOW(first.F, first.q)
    np.testing.assert_allclose(again.F, first.F, atol=1e-8)
    np.testing.assert_allclose(again.q, first.q, atol=1e-8)


def hardening(Jp):
    """Factor on the moduli of snow of a plastic volume ratio."""
    strain = 1e-4 * np.array([[[-2.0, 0.3], [0.3, -1.5]]])
    tau = [SNOW(np.eye(2) + strain, q).tau[0] for q in (np.ones(1), Jp)]
    soft, hard = tau[0], SNOW(np.tile(np.eye(2) + strain, (len(Jp), 1, 1)), Jp).tau
    return hard[:, 0, 0] / soft[0, 0]


def test_snow_hardens_under_compaction_between_its_bounds():
    Jp = np.linspace(0.6, 2.0, N)
    h = hardening(Jp)
    assert (np.diff(h) <= 1e-9).all()
    assert (h.min(), h.max()) == (pytest.approx(0.1), pytest.approx(5.0))
    inside = (h > 0.11) & (h < 4.9)
    assert inside.sum() > 30
    exact = np.exp(10.0 * (1.0 - Jp))  # Stomakhin et al. 2013, eq. 6
    np.testing.assert_allclose(h[inside], exact[inside], rtol=0.04)


@many
@given(rng=generators)
def test_moduli_give_back_youngs_modulus_and_poissons_ratio(rng):
    E, nu = rng.uniform(1, 1e3), rng.uniform(0, 0.45)
    elastic = law("elastic", youngs_modulus=E, poissons_ratio=nu)
    strain = 1e-6 * np.array([[1.0, 0.2], [0.2, 0.3]])
    tau = elastic((np.eye(2) + strain)[None]).tau[0]
    mu = tau[0, 1] / (2 * strain[0, 1])
    lam = (tau[0, 0] - 2 * mu * strain[0, 0]) / strain.trace()
    assert mu * (3 * lam + 2 * mu) / (lam + mu) == pytest.approx(E, rel=1e-4)
    assert lam / (2 * (lam + mu)) == pytest.approx(nu, abs=1e-4)


@many
@given(rng=generators)
def test_damping_is_newtonian(rng):
    C, eta = rng.normal(size=(N, 2, 2)), 0.7
    for model in ("elastic", "elastic_fem"):
        material = MATERIALS[model].model_construct(
            constitutive_model=model,
            density=1.0,
            damping=eta,
            youngs_modulus=1e-9,
            poissons_ratio=0.3,
        )
        code = code_of(material.hooks(frozenset({model})), model, "stress")
        tau = Particles(code, DT=1e-3)(C=C)["stress"]
        np.testing.assert_allclose(tau, eta * (C + C.transpose(0, 2, 1)), atol=1e-8)
    thick = liquid(1e-9, eta)(C=C, J=1.0)["stress"]
    np.testing.assert_allclose(thick, eta * (C + C.transpose(0, 2, 1)), atol=1e-8)


@many
@given(rng=generators)
def test_strain_follows_the_velocity_gradient(rng):
    C = rng.normal(size=(N, 2, 2))
    F = deformations(rng, 0.3, 2.0)
    material = MATERIALS["elastic"].model_construct(
        constitutive_model="elastic",
        density=1.0,
        damping=0.0,
        youngs_modulus=1.0,
        poissons_ratio=0.3,
    )
    code = code_of(material.hooks(frozenset({"elastic"})), "elastic", "stress")
    found = Particles(code, DT=0.01)(C=C, F=F)["F"]
    np.testing.assert_allclose(found, (np.eye(2) + 0.01 * C) @ F, atol=1e-14)


def test_pressure_of_a_liquid_rises_with_its_bulk_modulus():
    J = np.array([1.0, 1.0 - STEP])
    tau = liquid(400.0)(J=J)["stress"]
    pressure = -tau[:, 0, 0] / J
    assert pressure[0] == 0
    assert (pressure[1] - pressure[0]) / STEP == pytest.approx(400, rel=1e-4)


def test_a_liquid_bears_no_tension():
    assert (liquid()(J=np.linspace(1.0, 1.1, N))["stress"] == 0).all()


@many
@given(rng=generators)
def test_volume_of_a_liquid_follows_the_divergence(rng):
    C, J = rng.normal(size=(N, 2, 2)), rng.uniform(0.8, 1.0, N)
    found = liquid(dt=1e-3)(C=C, J=J)["J"]
    divergence = np.trace(C, axis1=1, axis2=2)
    np.testing.assert_allclose(found, J * (1 + 1e-3 * divergence))


@many
@given(rng=generators)
def test_settling_moves_volume_towards_what_the_density_says(rng):
    J, crowd = rng.uniform(0.6, 1.1, N), rng.uniform(0.05, 2.0, N)
    settled = SETTLE(J=J, g=crowd)["J"]
    far = abs(crowd - 1) > 0.05
    aim = (1 / crowd).clip(0.8, 1.05)
    np.testing.assert_array_equal(settled[~far], J[~far])
    np.testing.assert_allclose((settled - aim)[far], 0.8 * (J - aim)[far], atol=1e-12)


SETTLE = settling("liquid")
