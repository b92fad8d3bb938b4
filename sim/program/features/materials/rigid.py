"""Rigid bodies: pushed by matter on the grid, and by contacts of their rims.

Contacts are solved by sequential impulses [Catto 2005]: for each pair of a body and
another solid the two outermost points of its rim that touch, with impulses that start
from those of the step before.
"""

from typing import Literal

import numpy as np

from mpmworlds.sim.program.features.angles import unit
from mpmworlds.sim.program.features.material import Material, Numbers
from mpmworlds.sim.program.words import (
    BODIES,
    DT,
    DX,
    GRAVITY,
    PIXELS,
    POINTS,
    SOLIDS,
    SPACING,
    clamp,
    cmul,
    cross,
    ease,
    hit,
    hook,
    ivec2,
    kick,
    pose,
    rims,
    solid,
    spot,
    surface,
    ti,
    touching,
    twist,
    vec2,
    vec3,
    vec4,
    velocity_at,
)
from mpmworlds.sim.scene.fields import about


class Rigid(Material):
    """A rigid body that pushes particles, and is pushed by them."""

    FAMILY = "rigid"
    FLOWS = False

    constitutive_model: Literal["rigid"] = about("material", "constitutive model")
    restitution: float = about(
        "material", "part of speed after a bounce", default=0.2, ge=0.0, le=1.0
    )
    friction: float = about(
        "material", "Coulomb coefficient", default=0.3, ge=0.0, le=10.0
    )
    skin_cells: float = about(
        "neutral", "distance of contact", "cells", default=0.3, ge=0.0, le=1.0
    )

    def wave_speed(self) -> float:
        """No waves: it moves as one."""
        return 0.0

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """None: it has no particles."""
        return {}


SWEEPS = 10  # over all contacts, which share impulses; 6 hold a stack of five
FORESEEN = 5e-4  # gap [m] from which contacts are kept, so that they do not flicker
YIELD = 60.0  # rate at which overlap is undone [1/s]
BOUNCE = 0.1  # speed of approach [m/s] below which nothing bounces


def thing(x, y, degrees, friction, bounce=0.0, mass=np.inf, inertia=np.inf, *rate):
    """Row of a solid: center, cosine and sine of its angle, velocity, spin, others."""
    motion = *unit(np.radians(degrees)), *(rate or (0.0, 0.0, 0.0))
    return x, y, *motion, 1 / mass, 1 / inertia, bounce, friction


def rim(line, radius):
    """Points along a polyline, and the distance [m] of the surface from them."""
    points = [(*line[-1], radius)]
    for (ax, ay), (bx, by) in zip(line[:-1], line[1:], strict=True):
        far = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
        for part in np.arange(0, 1, SPACING / far):
            points.append((ax + part * (bx - ax), ay + part * (by - ay), radius))
    return np.array(points)


@hook.section
def fields(THINGS, RIMS):
    POINTS = max(len(points) for points in RIMS)
    RIMS = np.float32([np.resize(points, (POINTS, 3)) for points in RIMS])
    SOLIDS, BODIES = len(THINGS), len(RIMS)
    pose = ti.Vector.field(4, float, SOLIDS)  # center; cosine and sine of the angle
    twist = ti.Vector.field(3, float, SOLIDS)  # velocity and spin
    ease = ti.Vector.field(4, float, SOLIDS)  # 1 / mass, 1 / inertia; bounce; friction
    rims = ti.Vector.field(3, float, (BODIES, POINTS))
    touching = ti.Vector.field(3, float, POINTS)  # normal and distance of a solid
    spot, hit = (ti.Vector.field(4, float, (BODIES, SOLIDS, 2)) for _ in range(2))
    return RIMS, SOLIDS, BODIES, pose, twist, ease, rims, touching, spot, hit


@ti.func
def push(k, o, p, impulse):
    """Push body k by an impulse [kg m/s] at p, and solid o back."""
    twist[k] += vec3(ease[k].x * impulse, ease[k].y * cross(p - pose[k].xy, impulse))
    twist[o] -= vec3(ease[o].x * impulse, ease[o].y * cross(p - pose[o].xy, impulse))


@ti.func
def looseness(k, o, p, n):
    """Inverse of the mass [1/kg] that an impulse along n at p between k and o feels."""
    at_k, at_o = cross(p - pose[k].xy, n), cross(p - pose[o].xy, n)
    return ease[k].x + ease[o].x + ease[k].y * at_k * at_k + ease[o].y * at_o * at_o


@ti.func
def find_contacts(k, o):
    """Keep the two outermost points of the rim of body k that touch solid o."""
    mean = vec2(0.0)
    for i in range(POINTS):
        p = pose[k].xy + cmul(pose[k].zw, rims[k, i].xy)
        touching[i] = surface(o, p) - vec3(0.0, 0.0, rims[k, i].z)
        if touching[i].z < FORESEEN:
            mean += touching[i].xy
    low, high, ends = 1e9, -1e9, ivec2(-1, -1)
    for i in range(POINTS):
        if touching[i].z < FORESEEN and touching[i].xy.dot(mean) > 0.5 * mean.norm():
            aside = cross(cmul(pose[k].zw, rims[k, i].xy), mean)
            if aside < low:
                low, ends.x = aside, i
            if aside > high:
                high, ends.y = aside, i
    for end in ti.static(range(2)):
        i, before = ends[end], hit[k, o, end]
        hit[k, o, end] = vec4(0.0)
        if i >= 0 and (end == 0 or i != ends.x):
            n, gap = touching[i].xy, touching[i].z
            p = pose[k].xy + cmul(pose[k].zw, rims[k, i].xy) - rims[k, i].z * n
            speed = (velocity_at(k, p, n) - velocity_at(o, p, n)).dot(n)
            goal = -ti.max(gap, 0.0) / DT  # closes the gap within the step
            if speed < ti.min(goal, -BOUNCE):
                goal = -ease[k].z * speed
            spot[k, o, end] = vec4(p, n)
            hit[k, o, end] = vec4(1.0, goal, before.x * before.zw)
            away = YIELD * DT * ti.max(-gap, 0.0) / (ease[k].x + ease[o].x) * n
            pose[k].xy += ease[k].x * away
            pose[o].xy -= ease[o].x * away


@ti.func
def resist(k, o, end):
    """Bring a contact to its goal by impulses that push, with Coulomb friction."""
    p, n, before = spot[k, o, end].xy, spot[k, o, end].zw, hit[k, o, end].zw
    t, speed = vec2(n.y, -n.x), (velocity_at(k, p, n) - velocity_at(o, p, n)).dot(n)
    lack = (hit[k, o, end].y - speed) / looseness(k, o, p, n)
    normal = ti.max(before.x + lack, 0.0)
    push(k, o, p, (normal - before.x) * n)
    speed = (velocity_at(k, p, n) - velocity_at(o, p, n)).dot(t)
    most = ease[o].w * normal
    along = clamp(before.y - speed / looseness(k, o, p, t), -most, most)
    push(k, o, p, (along - before.y) * t)
    hit[k, o, end].zw = vec2(normal, along)


@ti.func
def move_bodies():
    """Move rigid bodies by gravity, by what hit them, and by contacts of their rims."""
    ti.loop_config(serialize=True)
    for k in range(BODIES):
        twist[k] += vec3(DT * GRAVITY, 0.0)
        hook.kicks(k)
    ti.loop_config(serialize=True)
    for k, o in ti.ndrange(BODIES, SOLIDS):
        if k != o:
            find_contacts(k, o)
    ti.loop_config(serialize=True)
    for sweep, k, o, end in ti.ndrange(SWEEPS + 1, BODIES, SOLIDS, 2):
        if hit[k, o, end].x > 0.0:
            n, J = spot[k, o, end].zw, hit[k, o, end].zw
            if sweep == 0:  # from the impulses of the step before
                push(k, o, spot[k, o, end].xy, J.x * n + J.y * vec2(n.y, -n.x))
            else:
                resist(k, o, end)
    ti.loop_config(serialize=True)
    for k in range(BODIES):
        turn = DT * twist[k].z  # 1 - turn^2 / 3 and turn are along the angle turn
        angle = cmul(pose[k].zw, vec2(1.0 - turn * turn / 3.0, turn)).normalized()
        pose[k] = vec4(pose[k].xy + DT * twist[k].xy, angle)


@hook.kicks
def kicks(k):
    twist[k] += vec3(ease[k].x * kick[k].xy, ease[k].y * kick[k].z)
    kick[k] = vec3(0.0)


@hook.contact
def kicked(i, j, k, m, u):
    before = u
    hook.touch(u)
    lost = m * (before - u)
    kick[k] += vec3(lost, cross(DX * vec2(i, j) - pose[k].xy, lost))


@hook.bake
def survey(first, last):
    for i, j in solid:
        q = vec4(0.0, 0.0, 1.0, 0.0)
        for k in range(first, last):
            s = surface(k, 0.5 * DX * vec2(i, j))
            if s.z < q.z:
                q = vec4(s, k - first)
        solid[i, j] = q


@hook.paint
def paint(backdrop, first, last, number):
    for j, i in ti.ndrange(PIXELS, PIXELS):
        for k in range(first, last):
            if surface(k, (vec2(i, j) + 0.5) / PIXELS).z < 0.0:
                backdrop[j, i] = ti.cast(number + k, ti.u8)


@hook.launch
def launch(things, outlines):
    for k in pose:
        for i in ti.static(range(4)):
            pose[k][i], ease[k][i] = things[k, i], things[k, 7 + i]
        twist[k] = vec3(things[k, 4], things[k, 5], things[k, 6])
    for k, i in rims:
        rims[k, i] = vec3(outlines[k, i, 0], outlines[k, i, 1], outlines[k, i, 2])
    hit.fill(0.0)
