"""Sand: Hencky strain, Mohr-Coulomb cone in 2D [Klar et al. 2016], cohesion if wet."""

import taichi as ti

from mpmworlds.sim.physics.deformation import restretch
from mpmworlds.sim.physics.hencky import hencky, hencky_stress, loosen


@ti.func
def hencky_sand(a, b, q, mu, lam, phi, bond):
    """Return-map F to the Mohr-Coulomb cone: new F and q, Kirchhoff stress t, z.

    |z| <= bond cos(phi) - t sin(phi) in the plane, for friction angle phi and cohesion
    `bond` [Pa]. At the tip of the cone, where t = bond / tan(phi), grains part.
    """
    m, g = hencky(a, b)
    slope = ti.sin(phi) * (mu + lam)
    tip = 0.5 * bond * ti.cos(phi) / slope
    m, new_q = loosen(m, q, tip)
    g = ti.min(g, slope / mu * (tip - m))
    new_a, new_b = restretch(a, b, ti.exp(m + g), ti.exp(m - g))
    t, z = hencky_stress(a, b, m, g, mu, lam)
    return new_a, new_b, new_q, t, z


@ti.func
def cohesion(saturation, most):
    """Cohesion [Pa] of wet sand: none dry or flooded, `most` at half saturation.

    Menisci between grains hold them together; neither dry nor drowned sand has any
    [as Mitarai and Nori 2006].
    """
    return 4.0 * most * saturation * (1.0 - saturation)


@ti.func
def soak(saturation, water, dt):
    """New saturation of sand next to `water`: mass of liquid here, relative to rest.

    Pores fill within 0.1 s of full contact, the slower the fuller; none dries.
    """
    return saturation + ti.min(water, 1.0) * (1.0 - saturation) * dt / 0.1
