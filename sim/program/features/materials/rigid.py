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
    rough,
    solid,
    spot,
    surface,
    ti,
    touching,
    twist,
    vec2,
    vec3,
    vec4,
)
from mpmworlds.sim.scene.fields import about


class Rigid(Material):
    """A rigid body that pushes particles, and is pushed by them."""

    FAMILY = "rigid"
    FLOWS = False

    constitutive_model: Literal["rigid"] = about("material", "constitutive model")
    restitution: float = about(
        "material",
        "part of speed after a bounce",
        default=0.2,
        ge=0.0,
        le=1.0,
        kind="fraction",
    )
    friction: float = about(
        "material", "Coulomb coefficient", default=0.3, ge=0.0, le=10.0, kind="friction"
    )
    skin_cells: float = about(
        "material",  # no other material has it
        "distance of contact",
        "cells",
        default=0.3,
        ge=0.0,
        le=1.0,
        kind="setting",
    )

    def wave_speed(self) -> float:
        """No waves: it moves as one."""
        return 0.0

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """None: it has no particles."""
        return {}


SWEEPS = 40  # over all contacts, which share impulses; 30 hold a stack of five
FORESEEN = 5e-4  # gap [m] from which contacts are kept, so that they do not flicker
YIELD = 60.0  # rate at which overlap is undone [1/s]
BOUNCE = 0.1  # speed of approach [m/s] below which nothing bounces


def thing(x, y, degrees, friction, bounce=0.0, mass=np.inf, inertia=np.inf, *rate):
    """Row of a solid: pose, velocity, spin, 1 / mass twice, 1 / inertia, and others."""
    motion = *unit(np.radians(degrees)), *(rate or (0.0, 0.0, 0.0))
    return x, y, *motion, 1 / mass, 1 / mass, 1 / inertia, bounce, friction


def rim(line, radius):
    """Points along a polyline, and the distance [m] of the surface from them."""
    points = [(*line[-1], radius)]
    for (ax, ay), (bx, by) in zip(line[:-1], line[1:], strict=True):
        for part in np.arange(0, 1, SPACING / np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)):
            points.append((ax + part * (bx - ax), ay + part * (by - ay), radius))
    return np.array(points)


@hook.section
def fields(THINGS, RIMS):
    SOLIDS, BODIES, POINTS = len(THINGS), len(RIMS), max(map(len, RIMS))
    RIMS = np.float32([np.resize(points, (POINTS, 3)) for points in RIMS])
    pose = ti.Vector.field(4, float, SOLIDS)  # center; cosine and sine of the angle
    twist, ease = (ti.Vector.field(3, float, SOLIDS) for _ in range(2))  # 1 / mass
    rough = ti.Vector.field(2, float, SOLIDS)  # part of speed after a bounce; friction
    rims = ti.Vector.field(3, float, (BODIES, POINTS))
    touching = ti.Vector.field(3, float, POINTS)  # normal and distance of a solid
    spot = ti.Vector.field(4, float, (BODIES, SOLIDS, 2))  # of a contact; normal
    hit = ti.Vector.field(4, float, (BODIES, SOLIDS, 2))  # on; speed after; impulses
    return RIMS, SOLIDS, BODIES, pose, twist, ease, rough, rims, touching, spot, hit


@ti.func
def lever(k, p, d):
    """What times the twist of solid k is its speed at p, times the length of d."""
    return vec3(d, cross(p - pose[k].xy, d))


@ti.func
def find_contacts(k, o):
    """Keep the two outermost points of the rim of body k that touch solid o."""
    mean = vec2(0.0)
    for i in range(POINTS):
        p = pose[k].xy + cmul(pose[k].zw, rims[k, i].xy)
        touching[i] = surface(o, p) - vec3(0.0, 0.0, rims[k, i].z)
        mean += ti.select(touching[i].z < FORESEEN, touching[i].xy, 0.0)
    low, high, ends = 1e9, -1e9, ivec2(-1, -1)
    for i in range(POINTS):
        if touching[i].z < FORESEEN and touching[i].xy.dot(mean) > 0.5 * mean.norm():
            aside = cross(cmul(pose[k].zw, rims[k, i].xy), mean)
            if aside < low:
                low, ends.x = aside, i
            if aside > high:
                high, ends.y = aside, i
    for end in ti.static(range(2)):
        i = ends[end]
        hit[k, o, end] = vec4(0.0)
        if i >= 0 and (end == 0 or i != ends.x):
            n, gap = touching[i].xy, touching[i].z
            p = pose[k].xy + cmul(pose[k].zw, rims[k, i].xy) - rims[k, i].z * n
            speed = lever(k, p, n).dot(twist[k]) - lever(o, p, n).dot(twist[o])
            goal = -ti.max(gap, 0.0) / DT  # closes the gap within the step
            if speed < ti.min(goal, -BOUNCE):
                goal = -rough[k].x * speed
            spot[k, o, end], hit[k, o, end] = vec4(p, n), vec4(1.0, goal, 0.0, 0.0)
            away = YIELD * DT * ti.max(-gap, 0.0) / (ease[k].x + ease[o].x) * n
            pose[k].xy += ease[k].x * away
            pose[o].xy -= ease[o].x * away


@ti.func
def impulse(k, o, p, d, goal, before, low, high):
    """Total impulse along d at p, within bounds, that parts k from o at a speed."""
    a, b = lever(k, p, d), lever(o, p, d)
    lack = goal - a.dot(twist[k]) + b.dot(twist[o])
    after = clamp(before + lack / (a.dot(ease[k] * a) + b.dot(ease[o] * b)), low, high)
    twist[k] += (after - before) * ease[k] * a
    twist[o] -= (after - before) * ease[o] * b
    return after


@ti.func
def move_bodies():
    """Move rigid bodies by gravity, by what hit them, and by contacts of their rims."""
    ti.loop_config(serialize=True)
    for _ in range(1):  # by one thread, in order
        for k in range(BODIES):
            hook.accelerate(k)
        for k, o in ti.ndrange(BODIES, SOLIDS):
            if k != o:
                find_contacts(k, o)
        for _, k, o, end in ti.ndrange(SWEEPS, BODIES, SOLIDS, 2):
            if hit[k, o, end].x > 0.0:
                p, n, J = spot[k, o, end].xy, spot[k, o, end].zw, hit[k, o, end].zw
                J.x = impulse(k, o, p, n, hit[k, o, end].y, J.x, 0.0, 1e9)
                most = rough[o].y * J.x
                hook.rub(k, o, p, n, J, most)
                hit[k, o, end].zw = J
        for k in range(BODIES):
            turn = DT * twist[k].z  # 1 - turn^2 / 3 and turn are along the angle turn
            angle = cmul(pose[k].zw, vec2(1.0 - turn * turn / 3.0, turn)).normalized()
            pose[k] = vec4(pose[k].xy + DT * twist[k].xy, angle)


@hook.rub
def rub(k, o, p, n, J, most, belt):
    J.y = impulse(k, o, p, vec2(n.y, -n.x), belt, J.y, -most, most)


@hook.accelerate
def fall(k):
    twist[k] += vec3(DT * GRAVITY, 0.0)


@hook.accelerate
def fall_and_be_kicked(k):
    twist[k] += vec3(DT * GRAVITY, 0.0) + ease[k] * kick[k]
    kick[k] = vec3(0.0)


@hook.contact
def kicked(i, j, k, m, u):
    before = u
    hook.touch(u)
    kick[k] += lever(k, DX * vec2(i, j), m * (before - u))


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
                backdrop[j, i] = number + k


@hook.launch
def launch(things, outlines):
    for k in pose:
        row = [things[k, i] for i in ti.static(range(12))]
        pose[k], twist[k] = row[:4], row[4:7]
        ease[k], rough[k] = row[7:10], row[10:]
    for k, i in rims:
        rims[k, i] = vec3(outlines[k, i, 0], outlines[k, i, 1], outlines[k, i, 2])
