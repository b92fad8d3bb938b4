"""Prescribed motion of colliders: displacement (x, y [m], angle [rad]) and its rate."""

import taichi as ti
from taichi.math import vec2, vec3


@ti.func
def rotate(t, angular_velocity):
    """Displacement and rate at time t [s] of constant spin [rad/s]."""
    return vec3(0.0, 0.0, angular_velocity * t), vec3(0.0, 0.0, angular_velocity)


@ti.func
def translate(t, velocity, start, stop):
    """Displacement and rate at time t [s] of a glide [m/s] from start to stop [s]."""
    v = vec2(velocity)
    moving = ti.select(start <= t and t < stop, 1.0, 0.0)
    return vec3(v * (ti.min(ti.max(t, start), stop) - start), 0.0), vec3(
        v * moving, 0.0
    )
