"""Maxwell fluids: Hencky strain whose deviator decays [Fang et al. 2019]."""

import taichi as ti

from mpmworlds.sim.physics.deformation import restretch
from mpmworlds.sim.physics.hencky import hencky, hencky_stress, loosen


@ti.func
def hencky_maxwell(a, b, q, dt, mu, lam, time):
    """Let F relax for a step: new F and q, Kirchhoff stress t, z.

    Shear decays as exp(-dt / time), so slow flow has viscosity mu time. Volume is
    elastic, but matter parts beyond a gain of a tenth.
    """
    m, g = hencky(a, b)
    m, new_q = loosen(m, q, 0.05)
    g *= ti.exp(-dt / time)
    new_a, new_b = restretch(a, b, ti.exp(m + g), ti.exp(m - g))
    t, z = hencky_stress(a, b, m, g, mu, lam)
    return new_a, new_b, new_q, t, z
