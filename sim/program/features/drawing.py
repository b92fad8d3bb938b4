"""How matter and solids are drawn: as metaballs, and by their signed distances."""

import numpy as np

from mpmworlds.sim.program.words import (
    PIXELS,
    SERIAL,
    SPACING,
    N,
    balls,
    clamp,
    each,
    hook,
    spread,
    still,
    surface,
    ti,
    vec2,
    x,
)


@hook.picture
def blobs():
    BLOB = 2.3 * SPACING * PIXELS  # radius of balls
    SOLID = 0.4 * np.pi * 2.3**2 / 3  # covers: 0.4 of their mean sum
    return BLOB, SOLID


@hook.picture
def backdrop(first):
    ROWS, COLUMNS = (np.mgrid[:PIXELS, :PIXELS] + 0.5) / PIXELS
    BACKDROP = np.int32(first * (still(COLUMNS, ROWS) < 0))
    return BACKDROP


@hook.picture
def backdrop_unpainted():
    BACKDROP = np.zeros((PIXELS, PIXELS), np.int32)
    return BACKDROP


@hook.picture
def backdrops(first):
    ROWS, COLUMNS = (np.mgrid[:PIXELS, :PIXELS] + 0.5) / PIXELS
    BACKDROP = np.zeros((PIXELS, PIXELS), np.int32)
    for number, distance in enumerate(each(COLUMNS, ROWS), first):
        BACKDROP[distance < 0] = number
    return BACKDROP


@hook.show
def show(image, j, i, seen):
    image[j, i] = seen


@hook.show
def show_before(image, j, i, seen):
    if image[j, i] == 0:
        image[j, i] = seen


@hook.balls
def ball(spot, step, BLOB, SOLID):
    ti.loop_config(serialize=SERIAL)
    for p in range(N):
        hook.unborn(p, step)
        center, R = x[p] * PIXELS - 0.5, BLOB * ti.sqrt(clamp(spread[p], 1.0, 3.0))
        low, high = int(center - R) + 1, int(center + R) + 1
        for j in range(low.y, high.y):
            for i in range(low.x, high.x):
                r2 = (vec2(i, j) - center).norm_sqr() / R**2
                spot += ti.max(1.0 - r2, 0) ** 2 + SOLID * (r2 < 0.06)
    return spot


@hook.seen
def none():
    seen = 0
    return seen


@hook.seen
def covered(i, j, SOLID):
    seen = int(balls[j, i] > SOLID)
    balls[j, i] = 0.0
    return seen


@hook.seen
def covered_most(i, j, count, SOLID):
    most, seen = SOLID, 0
    for k in range(count):
        if balls[j, i, k] > most:
            most, seen = balls[j, i, k], k + 1
        balls[j, i, k] = 0.0
    return seen


@hook.seen
def mover(i, j, k, number):
    if surface(k, (vec2(i, j) + 0.5) / PIXELS).z < 0.0:
        seen = number
    return seen
