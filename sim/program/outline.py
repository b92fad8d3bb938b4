"""The story of a program, with hooks where features have their say.

A statement `hook.NAME(...)` gives way to the code of features for that place. The
parameters that nothing reads then go, here and where the function is called.
"""

from typing import Any

import numpy as np

from mpmworlds.sim.program.fields import node, particle
from mpmworlds.sim.program.words import (
    AREA,
    DT,
    DX,
    FRAMES,
    GRAVITY,
    GRID,
    PALETTE,
    PIXELS,
    RATE,
    RELEASED,
    SERIAL,
    SPACING,
    SUBSTEPS,
    WALL,
    C,
    N,
    Node,
    X,
    Y,
    birth,
    clamp,
    cv2,
    flow,
    grid,
    hook,
    mass,
    mat2,
    stress,
    surface,
    sys,
    ti,
    v,
    vec2,
    x,
)

ARRAY: Any = ti.types.ndarray()
spread = particle("float", "0.0", "more than 1 where less than half is filled")
firm = node("float", "0.0", "mass of what does not give way to births [kg]")


@hook.section
def set_up():
    ti.init(ti.cpu, cpu_max_num_threads=1, fast_math=False, cfg_optimization=False)
    SERIAL = ti.cfg.arch in (ti.x64, ti.arm64)  # a GPU runs in parallel
    ARRAY = ti.types.ndarray()
    return SERIAL, ARRAY


@hook.section
def shaken(seed, side):
    shake = np.random.Generator(np.random.Philox(seed)).random((2, side, side))
    X, Y = SPACING * (np.mgrid[:side, :side] + 0.25 + 0.5 * shake)
    return X, Y


@hook.section
def fill_alone(density, distance):
    MASS = density * AREA  # of a particle [kg]
    INSIDE = distance < 0
    START = np.stack([X[INSIDE], Y[INSIDE]], axis=1)
    return MASS, START


@hook.section
def fill_one(k, density, distance):
    INSIDE = distance < 0
    ROWS = [k, density * AREA, X[INSIDE], Y[INSIDE]]
    START = np.stack(np.broadcast_arrays(*ROWS), axis=1)
    return START


@hook.section
def fill_one_moving(k, density, distance, u, v):
    INSIDE = distance < 0
    ROWS = [k, density * AREA, X[INSIDE], Y[INSIDE], u, v]
    START = np.stack(np.broadcast_arrays(*ROWS), axis=1)
    return START


@hook.place
def turn(p, spin, cx, cy):
    v[p] += spin * vec2(cy - x[p].y, x[p].x - cx)
    C[p] = mat2(0.0, -spin, spin, 0.0)


@hook.section
def release_alone(density, x, y, births):
    MASS = density * AREA  # of a particle [kg]
    TIME, PLACE, SPEED = births
    BIRTH = np.ceil(TIME / DT)
    PLACE = PLACE + SPEED * (BIRTH * DT - TIME)[:, None] + (x, y)
    START = np.concatenate([PLACE, SPEED], axis=1)
    return MASS, BIRTH, START


@hook.section
def release_one(k, density, x, y, births, START):
    TIME, PLACE, SPEED = births
    BIRTH = np.ceil(TIME / DT)
    PLACE = PLACE + SPEED * (BIRTH * DT - TIME)[:, None] + (x, y)
    ROWS = [k, density * AREA, *PLACE.T, *SPEED.T]
    BIRTH = np.concatenate([np.full(len(START), -1), BIRTH])
    START = np.concatenate([START, np.stack(np.broadcast_arrays(*ROWS), axis=1)])
    return BIRTH, START


@hook.section
def release_several(START):
    BIRTH = np.concatenate([np.full(len(START), -1), *(r[1] for r in RELEASED)])
    START = np.concatenate([START, *(rows for rows, _ in RELEASED)])
    return BIRTH, START


@hook.section
def release_several_alone():
    START, BIRTH = map(np.concatenate, zip(*RELEASED, strict=True))
    return START, BIRTH


@hook.unborn
def unborn(p, step):
    if birth[p] > step:
        hook.skip()


@hook.unborn
def unborn_yet(p, step):
    if birth[p] > step:
        if birth[p] == step + 1:  # it needs room, or what moves along
            hook.room(p)
        hook.skip()


@hook.room
def beside(p, here):
    at, u = int(x[p] * GRID + 0.5), v[p]
    if here > mass[p] and flow[at].xy.dot(u) < 0.5 * u.dot(u):
        birth[p] = 2**30  # never


@hook.scatter
def fill_up(p, base, w):
    for i, j in ti.static(ti.ndrange(3, 3)):
        firm[base.x + i, base.y + j] += w[i].x * w[j].y * mass[p]


@hook.room
def covered(p):
    if surface(0, x[p]).z < 0.0:
        birth[p] = 2**30


@hook.room
def covered_any(p, count):
    for k in range(count):
        if surface(k, x[p]).z < 0.0:
            birth[p] = 2**30


@hook.section
def main():
    if __name__ == "__main__":
        codec, size = cv2.VideoWriter_fourcc(*"VP80"), (PIXELS, PIXELS)
        video = cv2.VideoWriter(sys.argv[1], codec, RATE, size)
        for frame in frames():
            video.write(frame[:, :, ::-1])
        video.release()


def fill(k, density, distance):
    """Particles where a distance is negative: object, mass, place."""
    x, y = X[distance < 0], Y[distance < 0]
    return np.stack(np.broadcast_arrays(k, density * AREA, x, y), axis=1)


def fill_moving(k, density, distance, u=0.0, v=0.0):
    """Particles where a distance is negative: object, mass, place, velocity."""
    x, y = X[distance < 0], Y[distance < 0]
    return np.stack(np.broadcast_arrays(k, density * AREA, x, y, u, v), axis=1)


def release(k, density, x, y, births):
    """Particles that a nozzle at x, y releases, as of bodies, and steps of birth."""
    time, place, speed = births
    step = np.ceil(time / DT)
    place = place + speed * (step * DT - time)[:, None] + (x, y)
    rows = np.broadcast_arrays(k, density * AREA, *place.T, *speed.T)
    return np.stack(rows, axis=1), step


@hook.share
def share(i, j, p, base, w, mv):
    grid[base.x + i, base.y + j] += w[i].x * w[j].y * Node(mv, mass[p])


@hook.share
def share_area(i, j, p, base, w, mv):
    grid[base.x + i, base.y + j] += w[i].x * w[j].y * Node(mv, mass[p], AREA)


@hook.spread
def spread_by_mass(p, g):
    spread[p] = 0.5 * DX**2 * mass[p] / AREA / g.z


@hook.spread
def spread_by_area(p, g):
    spread[p] = 0.5 / g.w


@hook.advance
def advance(p, g):
    x[p] = clamp(x[p] + DT * g.xy, 2.0 * DX, 1.0 - 2.0 * DX)


@hook.gather
def gather(p, g, G):
    v[p], C[p] = g.xy, 4.0 / DX * G


@hook.fullness
def fullness(i, j):
    full = grid[i, j].w / DX**2
    return full


@hook.walls
def bounded(i, j, u):
    if ti.min(i, j, GRID - i, GRID - j) <= WALL:
        hook.touch(i, j, u)


@hook.enter
def enter_velocity(i, j, u, m):
    flow[i, j] = Node(u, m)


@hook.enter
def enter_fullness(i, j, u, m, full):
    flow[i, j] = Node(u, m, full)


@ti.kernel
def place(
    start: ARRAY,
    births: ARRAY,
    triangles: ARRAY,
    baked: ARRAY,
    solids: ARRAY,
    things: ARRAY,
    outlines: ARRAY,
    backdrop: ARRAY,
):
    """Put everything where it starts."""
    hook.place(start, births, triangles)
    hook.launch(solids, things, outlines)
    hook.bake(baked)
    hook.paint(backdrop)


@ti.func
def stencil(p):
    """First of 3 x 3 nodes around p, offset from it [cells], weights."""
    base = int(p * GRID - 0.5)
    f = p * GRID - base
    return base, f, [0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2]


@ti.kernel
def substep(step: int, now: ARRAY):
    """Advance by DT."""
    hook.tick(step, now)
    hook.clear()
    # Particles to grid: momentum with impulse of stress, mass
    ti.loop_config(serialize=SERIAL)
    for p in range(N):
        hook.unborn(p, step)
        A = mass[p] * DX * C[p] - 4.0 * DT * AREA / DX * stress[p]
        base, f, w = stencil(x[p])
        for i, j in ti.static(ti.ndrange(3, 3)):
            mv = mass[p] * v[p] + A @ (vec2(i, j) - f)
            hook.share(i, j, p, base, w, mv)
            hook.note(i, j, p, base, w, f)
        hook.scatter(p, base, w)
    # Grid: momentum to velocity, gravity, contact
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(GRID, GRID):
        m = grid[i, j].z
        if m > 0.0:
            hook.remember(i, j, m)
            u = grid[i, j].xy / m + DT * GRAVITY
            hook.fullness(i, j)
            hook.solids(i, j, u)
            hook.walls(i, j, u)
            hook.enter(i, j, u, m)
            grid[i, j] = Node(0.0)
    hook.bodies()
    # Grid to particles: velocity, place, strain, stress
    ti.loop_config(serialize=SERIAL)
    for p in range(N):
        hook.unborn_yet(p, step)
        base, f, w = stencil(x[p])
        g, G = Node(0.0), mat2(0.0)
        for i, j in ti.static(ti.ndrange(3, 3)):
            share = w[i].x * w[j].y * flow[base.x + i, base.y + j]
            g += share
            G += share.xy.outer_product(vec2(i, j) - f)
        hook.spread(p, g)
        hook.keep(p, base, w)
        hook.gather(p, g, G)
        hook.advance(p, g)
        hook.push_out(p, base)
        hook.settle(p, base, w, g)
        hook.stress(p)


@ti.kernel
def substep_of_bodies(step: int, now: ARRAY):
    """Advance by DT."""
    hook.tick(step, now)
    hook.bodies()


@ti.kernel
def draw(image: ARRAY, step: int):
    """Number what is seen in each pixel, bottom up."""
    hook.balls()
    ti.loop_config(serialize=SERIAL)
    for j, i in ti.ndrange(PIXELS, PIXELS):
        seen = hook.seen(i, j)
        hook.show(image, j, i, seen)


def frames():
    """Yield frames, uint8 RGB (PIXELS, PIXELS, 3)."""
    hook.start()
    for n in range(FRAMES):
        image = hook.backdrop()
        draw(image, SUBSTEPS * n - 1)
        yield PALETTE.take(image[::-1], axis=0)
        for step in range(SUBSTEPS * n, SUBSTEPS * (n + 1)):
            hook.substep(step)
