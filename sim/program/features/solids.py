"""Solids: what never moves is baked into a field, what moves has its own function."""

import numpy as np

from mpmworlds.sim.program.words import (
    DX,
    GRID,
    cconj,
    clamp,
    cmul,
    each,
    hook,
    near,
    pose,
    solid,
    still,
    surface,
    ti,
    twist,
    vec2,
    vec3,
    vec4,
    x,
)


@hook.baking
def bake():
    U, W = np.mgrid[: 2 * GRID, : 2 * GRID] * DX / 2
    east, west, here = still(U + 1e-4, W), still(U - 1e-4, W), still(U, W)
    north, south = still(U, W + 1e-4), still(U, W - 1e-4)
    BAKED = np.float32([(east - west) / 2e-4, (north - south) / 2e-4, here])
    return BAKED


@hook.baking
def bake_which():
    U, W = np.mgrid[: 2 * GRID, : 2 * GRID] * DX / 2
    east, west, here = still(U + 1e-4, W), still(U - 1e-4, W), still(U, W)
    north, south, which = still(U, W + 1e-4), still(U, W - 1e-4), each(U, W)
    which = np.argmin(which, axis=0)
    BAKED = np.float32([(east - west) / 2e-4, (north - south) / 2e-4, here, which])
    return BAKED


def still_of_each(x, y):
    """Signed distance [m] of points from the nearest thing that never moves."""
    return np.min(each(x, y), axis=0)


@hook.bake
def enter(baked):
    for i, j in solid:
        solid[i, j] = [baked[n, i, j] for n in ti.static(range(solid.n))]


@hook.tick
def follow(now, first):
    for k in range(now.shape[0]):
        pose[first + k] = vec4(now[k, 0], now[k, 1], now[k, 2], now[k, 3])
        twist[first + k] = vec3(now[k, 4], now[k, 5], now[k, 6])


@hook.tick
def follow_one(now, first):
    pose[first] = vec4(now[0], now[1], now[2], now[3])
    twist[first] = vec3(now[4], now[5], now[6])


@hook.launch
def launch_one(solids):
    pose[0] = vec4(solids[0], solids[1], solids[2], solids[3])


@hook.launch
def launch(solids):
    for k in range(solids.shape[0]):
        pose[k] = vec4(solids[k, 0], solids[k, 1], solids[k, 2], solids[k, 3])
        twist[k] = vec3(solids[k, 4], solids[k, 5], solids[k, 6])


@hook.own
def moving(k, p, distance):
    q = cmul(p - pose[k].xy, cconj(pose[k].zw))
    s = distance(q)
    return vec3(cmul(pose[k].zw, s.xy), s.z)


@hook.own
def moving_within(k, p, far, distance):
    s, q = vec3(0.0, 0.0, 1.0), cmul(p - pose[k].xy, cconj(pose[k].zw))
    if q.norm() < far:  # else it is as good as a meter away
        s = distance(q)
    return vec3(cmul(pose[k].zw, s.xy), s.z)


@hook.own
def moving_any(k, p):
    s, q = vec3(0.0, 0.0, 1.0), cmul(p - pose[k].xy, cconj(pose[k].zw))
    hook.shapes(k, q)
    return vec3(cmul(pose[k].zw, s.xy), s.z)


@hook.solids
def see(i, j, k, nearest):
    s = surface(k, DX * vec2(i, j))
    nearest = ti.select(s.z < nearest.z, s, nearest)
    return s, nearest


@hook.solids
def see_one(i, j):
    s = surface(0, DX * vec2(i, j))
    near[i, j] = s
    return s


@hook.solids
def touch_still(i, j, skin, u):
    q = solid[2 * i, 2 * j]
    if q.z < skin * DX:
        hook.contact(u, q)
    return u


@hook.solids
def meet_moving(i, j, k, s, skin, u, w):
    if s.z < skin * DX:
        r = DX * vec2(i, j) - pose[k].xy
        w = twist[k].xy + twist[k].z * vec2(-r.y, r.x)
        hook.contact(u, w, s)
    return u


@hook.solids
def meet_shifting(i, j, s, skin, u, w):
    if s.z < skin * DX:
        w = twist[0].xy
        hook.contact(u, w, s)
    return u


@hook.solids
def meet_turning(i, j, s, skin, u, w):
    if s.z < skin * DX:
        w = twist[0].z * vec2(pose[0].y - DX * j, DX * i - pose[0].x)
        hook.contact(u, w, s)
    return u


@hook.push_out
def push_still(p):
    cell = int(2.0 * GRID * x[p] + 0.5)
    q = solid[cell]
    x[p] -= clamp(q.z + q.xy.dot(x[p] - 0.5 * DX * cell), -DX, 0.0) * q.xy


@hook.push_out
def push_moving(p, base):
    s = near[base + 1]  # thin and fast ones overtake particles
    x[p] -= clamp(s.z + s.xy.dot(x[p] - DX * (base + 1)), -DX, 0.0) * s.xy
