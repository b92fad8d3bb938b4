"""Contact of grid velocities with rigid surfaces."""

import taichi as ti
from taichi.math import vec2


@ti.func
def touch(v, surface_v, n, law, friction):
    """Velocity v after contact with a surface of normal n that moves at surface_v.

    law: 0 sticky; 1 slip, no normal motion; 2 separate, no motion inwards. What the
    surface takes from the normal part bounds Coulomb friction on the tangential part.
    """
    u = v - surface_v
    normal = u.dot(n)
    if law == 0:
        u = vec2(0.0)
    elif law == 1 or normal < 0.0:
        u -= normal * n
        speed = u.norm()
        u *= ti.max(1.0 - friction * ti.max(-normal, 0.0) / ti.max(speed, 1e-9), 0.0)
    return surface_v + u
