"""Snow: elasticity that hardens under compaction [Stomakhin et al. 2013]."""

import taichi as ti

from mpmworlds.sim.physics.deformation import restretch


@ti.func
def pack(a, b, Jp, compression, stretch):
    """Keep singular values of F in [1 - compression, 1 + stretch]; Jp takes the rest.

    Jp is the plastic volume ratio, bounded so that hardening stays reversible.
    """
    A, B = a.norm(), b.norm()
    s1 = ti.min(ti.max(A + B, 1.0 - compression), 1.0 + stretch)
    s2 = ti.min(ti.max(A - B, 1.0 - compression), 1.0 + stretch)
    new_a, new_b, new_Jp = a, b, Jp
    if s1 != A + B or s2 != A - B:
        new_a, new_b = restretch(a, b, s1, s2)
        new_Jp = ti.min(ti.max(Jp * (A * A - B * B) / (s1 * s2), 0.6), 20.0)
    return new_a, new_b, new_Jp


@ti.func
def hardening(Jp, rate, lowest, highest):
    """Factor exp(rate (1 - Jp)) on the moduli, clamped to [lowest, highest]."""
    return ti.min(ti.max(ti.exp(rate * (1.0 - Jp)), lowest), highest)
