"""Rigid bodies: impulses of contacts between two bodies."""

import taichi as ti


@ti.func
def cross(r, u):
    """Turning effect r x u of u at arm r."""
    return r.x * u.y - r.y * u.x


@ti.func
def strike(u, n, r, s, w, restitution, friction):
    """Impulse [kg m/s] that stops a body from meeting another with velocity u [m/s].

    n: normal of the contact; r, s: its arm [m] from the body and from the other; w:
    1 / mass and 1 / inertia of the body, then of the other. Coulomb friction takes at
    most what the normal part allows; contacts slower than 0.1 m/s do not bounce.
    """
    impulse = 0.0 * n
    approach = -u.dot(n)
    if approach > 0.0:
        t = ti.Vector([n.y, -n.x])
        loose = w.x + w.z  # inverse of the mass that feels the impulse
        loose_n = loose + w.y * cross(r, n) ** 2 + w.w * cross(s, n) ** 2
        loose_t = loose + w.y * cross(r, t) ** 2 + w.w * cross(s, t) ** 2
        normal = approach * ti.select(approach > 0.1, 1.0 + restitution, 1.0) / loose_n
        most = friction * normal
        impulse = normal * n - t * ti.min(ti.max(u.dot(t) / loose_t, -most), most)
    return impulse
