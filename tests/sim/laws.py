"""Constitutive laws for many F at once: the strain that is kept, and its stress."""

from dataclasses import dataclass

import numpy as np
import taichi as ti
from taichi.math import vec2

from mpmworlds.sim.physics.elastic import fixed_corotated
from mpmworlds.sim.physics.plastic import hencky_plastic
from mpmworlds.sim.physics.sand import hencky_sand
from mpmworlds.sim.physics.viscoelastic import hencky_maxwell
from mpmworlds.sim.physics.viscoplastic import hencky_paste
from tests.sim.lab import matrix, pair, parts, symmetric, vectorised

MU, LAM = 1.0, 1.5  # of all laws below
PHI = np.radians(35.0)
BOND = 0.1  # cohesion of wet sand
YIELD = 0.2  # shear stress at which the others yield
SLOPE = 0.5  # of hardening
STEP = 1e-6  # of finite differences


@ti.func
def _joined(a, b, q, t, z):
    return ti.Vector([a.x, a.y, b.x, b.y, q, t, z.x, z.y])


@ti.func
def _corotated(r):
    a, b = vec2(r[0], r[1]), vec2(r[2], r[3])
    t, z = fixed_corotated(a, b, MU, LAM)
    return _joined(a, b, r[4], t, z)


@ti.func
def _sand(r):
    a, b = vec2(r[0], r[1]), vec2(r[2], r[3])
    a, b, q, t, z = hencky_sand(a, b, r[4], MU, LAM, PHI, r[5])
    return _joined(a, b, q, t, z)


@ti.func
def _plastic(r):
    a, b = vec2(r[0], r[1]), vec2(r[2], r[3])
    a, b, q, t, z = hencky_plastic(a, b, r[4], MU, LAM, r[5], r[6])
    return _joined(a, b, q, t, z)


@ti.func
def _paste(r):
    a, b = vec2(r[0], r[1]), vec2(r[2], r[3])
    a, b, q, t, z = hencky_paste(a, b, r[4], r[5], MU, LAM, r[6], r[7], r[8])
    return _joined(a, b, q, t, z)


@ti.func
def _maxwell(r):
    a, b = vec2(r[0], r[1]), vec2(r[2], r[3])
    a, b, q, t, z = hencky_maxwell(a, b, r[4], r[5], MU, LAM, r[6])
    return _joined(a, b, q, t, z)


@dataclass(frozen=True)
class Strained:
    """Deformations that are kept (n, 2, 2), states q (n,), stresses (n, 2, 2)."""

    F: np.ndarray
    q: np.ndarray
    tau: np.ndarray

    @property
    def mean(self):
        """Mean stress (n,)."""
        return 0.5 * self.tau.trace(axis1=1, axis2=2)

    @property
    def shear(self):
        """Largest shear stress (n,)."""
        low, high = np.linalg.eigvalsh(self.tau).T
        return 0.5 * (high - low)


def _law(function):
    """Map F (n, 2, 2), q and parameters, each a number or (n,), to what is kept."""
    apply = vectorised(function, 8)

    def law(F, q=1.0, *parameters):
        found = apply(*parts(*pair(F)), q, *parameters)
        kept = matrix(found[0] + 1j * found[1], found[2] + 1j * found[3])
        return Strained(kept, found[4], symmetric(*found[5:]))

    return law


COROTATED, SAND, PLASTIC = _law(_corotated), _law(_sand), _law(_plastic)
PASTE, MAXWELL = _law(_paste), _law(_maxwell)

INSTANT = {  # laws without memory of time: F, q -> Strained
    "sand": lambda F, q=1.0: SAND(F, q, 0.0),
    "wet sand": lambda F, q=1.0: SAND(F, q, BOND),
    "plastic": lambda F, q=1.0: PLASTIC(F, q, YIELD, 0.0),
    "hardening": lambda F, q=1.0: PLASTIC(F, q, YIELD, SLOPE),
}
FLOWING = {  # over a step of time in which they flow much
    "bingham": lambda F, q=1.0: PASTE(F, q, 1.0, YIELD, 2.0, 1.0),
    "thinning": lambda F, q=1.0: PASTE(F, q, 1.0, YIELD, 2.0, 0.5),
    "thickening": lambda F, q=1.0: PASTE(F, q, 1.0, YIELD, 2.0, 2.0),
    "maxwell": lambda F, q=1.0: MAXWELL(F, q, 1.0, 2.0),
}
HENCKY = INSTANT | FLOWING
LAWS = {"corotated": COROTATED} | HENCKY


def energy_corotated(F):
    """mu |F - R|^2 + lam (J - 1)^2 / 2."""
    s = np.linalg.svd(F, compute_uv=False)
    return MU * ((s - 1) ** 2).sum(-1) + 0.5 * LAM * (s.prod(-1) - 1) ** 2


def energy_hencky(F):
    """mu |e|^2 + lam (tr e)^2 / 2 of the logarithmic strains e."""
    e = np.log(np.linalg.svd(F, compute_uv=False))
    return MU * (e**2).sum(-1) + 0.5 * LAM * e.sum(-1) ** 2


def work_conjugate(energy, F):
    """(d energy / dF) F^T by central differences, (n, 2, 2)."""
    P = np.zeros_like(F)
    for i, j in np.ndindex(2, 2):
        dF = np.zeros((2, 2))
        dF[i, j] = STEP
        P[:, i, j] = (energy(F + dF) - energy(F - dF)) / (2 * STEP)
    return P @ F.transpose(0, 2, 1)
