"""Sticky contact: matter moves as the surface does."""

from mpmworlds.sim.program.words import (
    hook,
    vec2,
)


@hook.touch
def touch(u):
    u = vec2(0.0)
    return u


@hook.touch
def bound(u):
    u = vec2(0.0)
    return u


@hook.touch
def meet(u, w):
    u = w
    return u
