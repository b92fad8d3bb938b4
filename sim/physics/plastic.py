"""Metal-like plasticity: Hencky strain, von Mises, linear isotropic hardening."""

import taichi as ti

from mpmworlds.sim.physics.deformation import restretch
from mpmworlds.sim.physics.hencky import hencky, hencky_stress


@ti.func
def hencky_plastic(a, b, q, mu, lam, k, slope):
    """Return-map F to the yield surface: new F and q, Kirchhoff stress t, z.

    Shear stress |z| <= k + slope (q - 1) [Pa], where q - 1 is the plastic shear strain
    so far. In the plane this is von Mises, with k sqrt(3) the uniaxial yield stress,
    and Tresca. Volume stays elastic [Simo 1992].
    """
    m, g = hencky(a, b)
    excess = 2.0 * mu * g - k - slope * (q - 1.0)
    new_a, new_b, new_q = a, b, q
    if excess > 0.0:
        new_q += excess / (mu + slope)
        g -= 0.5 * excess / (mu + slope)
        new_a, new_b = restretch(a, b, ti.exp(m + g), ti.exp(m - g))
    t, z = hencky_stress(a, b, m, g, mu, lam)
    return new_a, new_b, new_q, t, z
