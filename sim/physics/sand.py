"""Dry sand: Hencky strain, Mohr-Coulomb cone in 2D [Klar et al. 2016]."""

import taichi as ti
from taichi.math import cmul

from mpmworlds.sim.physics.deformation import restretch


@ti.func
def hencky_sand(a, b, q, mu, lam, sin_phi):
    """Return-map F to the friction cone: new F and q, Kirchhoff stress t, z.

    With m the mean and g the half difference of log strains, friction angle phi means
    mu g <= -sin(phi) (lam + mu) m in the plane. Expansion is free of stress; its log
    volume, q - 1, is undone before pressure returns [Tampubolon et al. 2017].
    """
    A, B = a.norm(), b.norm()
    e1 = ti.log(ti.max(A + B, 0.05))
    e2 = ti.log(ti.max(A - B, 0.05))
    m = 0.5 * (e1 + e2 + q - 1.0)
    g = 0.5 * (e1 - e2)
    new_q = 1.0 + ti.max(2.0 * m, 0.0)
    m = ti.min(m, 0.0)
    g = ti.min(g, -sin_phi * (lam + mu) / mu * m)
    new_a, new_b = restretch(a, b, ti.exp(m + g), ti.exp(m - g))
    z = 2.0 * mu * g * cmul(a, b) / ti.max(A * B, 1e-12)
    return new_a, new_b, new_q, 2.0 * (lam + mu) * m, z
