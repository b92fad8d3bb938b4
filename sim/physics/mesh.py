"""Triangle meshes: the strain of a triangle and the forces on its corners."""

import taichi as ti
from taichi.math import cconj, cmul, vec2


@ti.func
def triangle_strain(e1, e2, E1, E2, area):
    """F = (a, b) that takes the edges E1, E2 of a triangle at rest to e1, e2 [m].

    e = a E + b conj(E) for both edges, solved by Cramer's rule; area [m^2] at rest.
    """
    i_over_det = vec2(0.0, 0.25 / area)
    a = cmul(i_over_det, cmul(e1, cconj(E2)) - cmul(e2, cconj(E1)))
    b = cmul(i_over_det, cmul(e2, E1) - cmul(e1, E2))
    return a, b


@ti.func
def corotated_force(a, b, E, mu, lam):
    """Force [N] of fixed corotated elasticity on the corner across the edge E at rest.

    First Piola stress P = 2 mu (F - R) + lam (J - 1) cof F [Stomakhin et al. 2012]
    acts on the outward normal of the edge, times half its length.
    """
    squeeze = lam * (a.dot(a) - b.dot(b) - 1.0)
    pa = (2.0 * mu * (1.0 - 1.0 / ti.max(a.norm(), 1e-6)) + squeeze) * a
    pb = (2.0 * mu - squeeze) * b
    n = vec2(0.5 * E.y, -0.5 * E.x)
    return cmul(pa, n) + cmul(pb, cconj(n))
