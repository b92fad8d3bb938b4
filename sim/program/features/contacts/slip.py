"""Slipping contact: no motion inwards or outwards, Coulomb friction."""

from mpmworlds.sim.program.words import (
    hook,
    ti,
    vec2,
)


@ti.func
def cling(u, n, friction):
    """Velocity u along a surface of normal n that it never leaves, with friction."""
    into = ti.min(u.dot(n), 0.0)
    u -= u.dot(n) * n
    return u * ti.max(1.0 + friction * into / ti.max(u.norm(), 1e-9), 0.0)


@hook.touch
def touch(u, n, friction):
    u = cling(u, n, friction)
    return u


@hook.touch
def bound(i, j, u, friction):
    n = hook.inwards(i, j)
    u = cling(cling(u, vec2(n.x, 0.0), friction), vec2(0.0, n.y), friction)
    return u


@hook.touch
def meet(u, w, n, friction):
    u = w + cling(u - w, n, friction)
    return u
