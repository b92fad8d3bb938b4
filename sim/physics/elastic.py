"""Hyperelastic Kirchhoff stress tau = P F^T, returned as t, z: tau = t I + D(z)."""

import taichi as ti
from taichi.math import cmul


@ti.func
def lame(E, nu):
    """Lame parameters mu, lam [Pa] of Young's modulus E [Pa], Poisson's ratio nu."""
    mu = 0.5 * E / (1.0 + nu)
    return mu, 2.0 * mu * nu / (1.0 - 2.0 * nu)


@ti.func
def fixed_corotated(a, b, mu, lam):
    """tau = 2 mu (F - R) F^T + lam J (J - 1) I [Stomakhin et al. 2012]."""
    A = ti.max(a.norm(), 1e-6)
    B2 = b.dot(b)
    J = A * A - B2
    t = 2.0 * mu * (A * A + B2 - A) + lam * J * (J - 1.0)
    return t, 2.0 * mu * (2.0 - 1.0 / A) * cmul(a, b)
