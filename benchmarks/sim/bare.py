"""The transfers of a program alone, which `ours.py` runs like a whole one.

No law, no contact, no wall: the ceiling for programs that move particles this way.
"""

import numpy as np
import taichi as ti
from taichi.math import mat2, vec2, vec3

ti.init(
    ti.cpu,
    cpu_max_num_threads=1,
    fast_math=False,
    cfg_optimization=False,
    log_level=ti.ERROR,
)

GRID, N, DT = 128, 10_000, 1e-4
DX, MASS = 1 / GRID, 1000.0 / (2 * GRID) ** 2
x, v = (ti.Vector.field(2, float, N) for _ in range(2))
C = ti.Matrix.field(2, 2, float, N)
grid, flow = (vec3.field(shape=(GRID, GRID)) for _ in range(2))


@ti.func
def stencil(p):  # noqa: ANN001, ANN201
    """First of 3 x 3 nodes around p, offset from it [cells], weights."""
    base = int(p * GRID - 0.5)
    f = p * GRID - base
    return base, f, [0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2]


@ti.kernel
def substep():  # noqa: ANN201
    """Particles to grid, gravity, grid to particles."""
    ti.loop_config(serialize=True)
    for p in range(N):
        A = MASS * DX * C[p]
        base, f, w = stencil(x[p])
        for i, j in ti.static(ti.ndrange(3, 3)):
            mv = MASS * v[p] + A @ (vec2(i, j) - f)
            grid[base.x + i, base.y + j] += w[i].x * w[j].y * vec3(mv, MASS)
    ti.loop_config(serialize=True)
    for i, j in ti.ndrange(GRID, GRID):
        m = grid[i, j].z
        if m > 0.0:
            flow[i, j] = vec3(grid[i, j].xy / m + DT * vec2(0.0, -9.8), m)
            grid[i, j] = vec3(0.0)
    ti.loop_config(serialize=True)
    for p in range(N):
        base, f, w = stencil(x[p])
        g, G = vec3(0.0), mat2(0.0)
        for i, j in ti.static(ti.ndrange(3, 3)):
            share = w[i].x * w[j].y * flow[base.x + i, base.y + j]
            g += share
            G += share.xy.outer_product(vec2(i, j) - f)
        v[p], C[p] = g.xy, 4.0 / DX * G
        x[p] += DT * g.xy


def frames():  # noqa: ANN201
    """Yield once, when the particles of a block are in place."""
    lattice = (np.mgrid[:100, :100].reshape(2, N).T + 0.5) * 0.5 * DX
    x.from_numpy((lattice + (0.3, 0.55)).astype(np.float32))
    yield
