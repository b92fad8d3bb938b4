"""Prescribed motion of colliders: displacement (x, y [m], angle [rad]) and its rate.

A rate has a fourth part: the speed [m/s] at which the surface runs clockwise around.
"""

import taichi as ti
from taichi.math import vec2, vec3, vec4


@ti.func
def rotate(t, angular_velocity):
    """Displacement and rate at time t [s] of constant spin [rad/s]."""
    return vec3(0.0, 0.0, angular_velocity * t), vec4(0.0, 0.0, angular_velocity, 0.0)


@ti.func
def translate(t, velocity, start, stop):
    """Displacement and rate at time t [s] of a glide [m/s] from start to stop [s]."""
    v = vec2(velocity)
    moving = ti.select(start <= t and t < stop, 1.0, 0.0)
    shift = v * (ti.min(ti.max(t, start), stop) - start)
    return vec3(shift, 0.0), vec4(v * moving, 0.0, 0.0)
