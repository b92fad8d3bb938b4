"""Fluids with a yield stress: Hencky strain, overstress flow [Yue et al. 2015]."""

import taichi as ti

from mpmworlds.sim.physics.deformation import restretch
from mpmworlds.sim.physics.hencky import hencky, hencky_stress, loosen


@ti.func
def overstress(excess, drag, eta, n):
    """Solve x + drag (x / eta)^(1/n) = excess > 0 for x [Pa]; drag = mu dt [Pa s].

    Closed for n = 1; else Newton's method in u = log(x / eta), where the equation is
    nearly linear, from the nearer of its limits for small and large drag. Two steps
    leave an error below 0.2 % for n of 0.2 to 2.
    """
    x = excess * eta / (eta + drag)
    if n != 1.0:
        u = ti.min(ti.log(excess / eta), n * ti.log(excess / drag))
        for _ in range(2):
            rest, flow = eta * ti.exp(u), drag * ti.exp(u / n)
            u -= ti.log((rest + flow) / excess) * (rest + flow) / (rest + flow / n)
        x = eta * ti.exp(u)
    return x


@ti.func
def hencky_paste(a, b, q, dt, mu, lam, k, eta, n):
    """Let F flow for a step: new F and q, Kirchhoff stress t, z.

    Herschel-Bulkley: shear stress |z| = k + eta (shear rate)^n, eta [Pa s^n], of which
    n = 1 is Bingham's; elastic below k. Volume is elastic, but matter parts beyond a
    gain of a tenth.
    """
    m, g = hencky(a, b)
    m, new_q = loosen(m, q, 0.05)
    excess = 2.0 * mu * g - k
    if excess > 0.0:
        g = 0.5 / mu * (k + overstress(excess, mu * dt, eta, n))
    new_a, new_b = restretch(a, b, ti.exp(m + g), ti.exp(m - g))
    t, z = hencky_stress(a, b, m, g, mu, lam)
    return new_a, new_b, new_q, t, z
