"""Prescribed motion of colliders: displacement (x, y [m], angle [rad]) and its rate.

A rate has a fourth part: the speed [m/s] at which the surface runs clockwise around.
Parameters come as the mapping that the scene has; every motion has a start and a stop.
"""

import taichi as ti
from taichi.math import vec2, vec3, vec4


@ti.func
def elapsed(t, motion: ti.template()):
    """Time [s] for which a motion has gone on at time t [s], and 1 while it does."""
    start, stop = motion["start"], motion["stop"]
    moving = ti.select(start <= t and t < stop, 1.0, 0.0)
    return ti.min(ti.max(t, start), stop) - start, moving


@ti.func
def rotate(t, motion: ti.template()):
    """Displacement and rate at time t [s] of a constant angular_velocity [rad/s]."""
    time, moving = elapsed(t, motion)
    spin = vec3(0.0, 0.0, motion["angular_velocity"])
    return time * spin, moving * vec4(spin, 0.0)


@ti.func
def translate(t, motion: ti.template()):
    """Displacement and rate at time t [s] of a constant velocity [m/s]."""
    time, moving = elapsed(t, motion)
    glide = vec3(vec2(motion["velocity"]), 0.0)
    return time * glide, moving * vec4(glide, 0.0)


@ti.func
def oscillate(t, motion: ti.template()):
    """Displacement and rate at time t [s] of amplitude (sin(w t + phase) - sin(phase)).

    The amplitude is one of place [m] and amplitude_deg; w = 2 pi frequency [Hz].
    """
    time, moving = elapsed(t, motion)
    swing = vec3(vec2(motion["amplitude"]), ti.math.radians(motion["amplitude_deg"]))
    w = 2.0 * ti.math.pi * motion["frequency"]
    first = ti.math.radians(motion["phase_deg"])
    angle = first + w * time
    moved = swing * (ti.sin(angle) - ti.sin(first))
    return moved, moving * w * ti.cos(angle) * vec4(swing, 0.0)


@ti.func
def conveyor(t, motion: ti.template()):
    """Displacement and rate at time t [s] of a belt with a surface_speed [m/s]."""
    _, moving = elapsed(t, motion)
    return vec3(0.0), vec4(0.0, 0.0, 0.0, moving * motion["surface_speed"])
