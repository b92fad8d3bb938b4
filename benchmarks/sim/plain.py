"""A plain MLS-MPM program in the style of Taichi's mpm128 example: the yardstick.

Parallel loops, matrices, an SVD for every particle and step, no scene but one block.
Run as `plain.py MATERIAL THREADS`, it answers each line on standard input, a number of
substeps, with the seconds that they took.
"""

import sys
import time

import numpy as np
import taichi as ti

MATERIAL, THREADS = sys.argv[1], int(sys.argv[2])
ti.init(arch=ti.cpu, cpu_max_num_threads=THREADS, log_level=ti.ERROR)

N_GRID, N = 128, 10_000
DX, DT = 1.0 / N_GRID, 1e-4
VOLUME = (0.5 * DX) ** 2
DENSITY = {"liquid": 1000.0, "elastic": 1000.0, "snow": 400.0, "sand": 1600.0}[MATERIAL]
E = {"liquid": 4e5, "elastic": 4e5, "snow": 6e4, "sand": 8e5}[MATERIAL]
MU, LAM = E / 2.6, E * 0.3 / (1.3 * 0.4)
MASS = VOLUME * DENSITY
ALPHA = np.sin(np.radians(35.0)) / np.sqrt(2.0)

x = ti.Vector.field(2, ti.f32, N)
v = ti.Vector.field(2, ti.f32, N)
C = ti.Matrix.field(2, 2, ti.f32, N)
F = ti.Matrix.field(2, 2, ti.f32, N)
Jp = ti.field(ti.f32, N)
grid_v = ti.Vector.field(2, ti.f32, (N_GRID, N_GRID))
grid_m = ti.field(ti.f32, (N_GRID, N_GRID))


@ti.func
def corotated(p, mu, lam):
    """First Piola stress times F^T of fixed corotated elasticity."""
    U, sig, V = ti.svd(F[p])
    J = sig[0, 0] * sig[1, 1]
    R = U @ V.transpose()
    identity = ti.Matrix.identity(ti.f32, 2)
    return 2.0 * mu * (F[p] - R) @ F[p].transpose() + lam * J * (J - 1.0) * identity


@ti.func
def liquid(p):
    """Volume only: F stays isotropic."""
    J = F[p].determinant()
    identity = ti.Matrix.identity(ti.f32, 2)
    F[p] = ti.sqrt(J) * identity
    return LAM * J * (J - 1.0) * identity


@ti.func
def snow(p):
    """Singular values clamped, hardening."""
    U, sig, V = ti.svd(F[p])
    for d in ti.static(range(2)):
        kept = ti.min(ti.max(sig[d, d], 1.0 - 2.5e-2), 1.0 + 4.5e-3)
        Jp[p] *= sig[d, d] / kept
        sig[d, d] = kept
    F[p] = U @ sig @ V.transpose()
    h = ti.min(ti.max(ti.exp(10.0 * (1.0 - Jp[p])), 0.1), 5.0)
    return corotated(p, MU * h, LAM * h)


@ti.func
def sand(p):
    """Hencky strain, Drucker-Prager cone."""
    U, sig, V = ti.svd(F[p])
    e = ti.Vector([ti.log(ti.max(sig[d, d], 0.05)) for d in range(2)])
    trace = e[0] + e[1] + Jp[p]
    dev = e - 0.5 * (e[0] + e[1])
    size = dev.norm() + 1e-20
    if trace >= 0.0:
        e, Jp[p] = ti.Vector([0.0, 0.0]), trace
    else:
        Jp[p] = 0.0
        excess = size + (LAM + MU) / MU * trace * ALPHA
        if excess > 0.0:
            e -= excess * dev / size
    for d in ti.static(range(2)):
        sig[d, d] = ti.exp(e[d])
    F[p] = U @ sig @ V.transpose()
    tau = ti.Matrix.zero(ti.f32, 2, 2)
    for d in ti.static(range(2)):
        tau[d, d] = 2.0 * MU * e[d] + LAM * (e[0] + e[1])
    return U @ tau @ U.transpose()


@ti.kernel
def substep():
    for i, j in grid_m:
        grid_v[i, j] = [0.0, 0.0]
        grid_m[i, j] = 0.0
    for p in x:
        base = (x[p] / DX - 0.5).cast(int)
        fx = x[p] / DX - base.cast(float)
        w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1.0) ** 2, 0.5 * (fx - 0.5) ** 2]
        F[p] = (ti.Matrix.identity(ti.f32, 2) + DT * C[p]) @ F[p]
        stress = ti.Matrix.zero(ti.f32, 2, 2)
        if ti.static(MATERIAL == "liquid"):
            stress = liquid(p)
        elif ti.static(MATERIAL == "elastic"):
            stress = corotated(p, MU, LAM)
        elif ti.static(MATERIAL == "snow"):
            stress = snow(p)
        else:
            stress = sand(p)
        affine = -DT * VOLUME * 4.0 / DX**2 * stress + MASS * C[p]
        for i, j in ti.static(ti.ndrange(3, 3)):
            offset = ti.Vector([i, j])
            dpos = (offset.cast(float) - fx) * DX
            weight = w[i][0] * w[j][1]
            grid_v[base + offset] += weight * (MASS * v[p] + affine @ dpos)
            grid_m[base + offset] += weight * MASS
    for i, j in grid_m:
        if grid_m[i, j] > 0.0:
            grid_v[i, j] = grid_v[i, j] / grid_m[i, j]
            grid_v[i, j][1] -= DT * 9.8
            if i < 3 and grid_v[i, j][0] < 0.0:
                grid_v[i, j][0] = 0.0
            if i > N_GRID - 3 and grid_v[i, j][0] > 0.0:
                grid_v[i, j][0] = 0.0
            if j < 3 and grid_v[i, j][1] < 0.0:
                grid_v[i, j][1] = 0.0
            if j > N_GRID - 3 and grid_v[i, j][1] > 0.0:
                grid_v[i, j][1] = 0.0
    for p in x:
        base = (x[p] / DX - 0.5).cast(int)
        fx = x[p] / DX - base.cast(float)
        w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1.0) ** 2, 0.5 * (fx - 0.5) ** 2]
        new_v = ti.Vector.zero(ti.f32, 2)
        new_C = ti.Matrix.zero(ti.f32, 2, 2)
        for i, j in ti.static(ti.ndrange(3, 3)):
            dpos = ti.Vector([i, j]).cast(float) - fx
            g_v = grid_v[base + ti.Vector([i, j])]
            weight = w[i][0] * w[j][1]
            new_v += weight * g_v
            new_C += 4.0 / DX * weight * g_v.outer_product(dpos)
        v[p], C[p] = new_v, new_C
        x[p] += DT * v[p]


def main() -> None:
    """Answer each number of substeps with the seconds they take."""
    rng = np.random.default_rng(0)
    lattice = np.argwhere(np.ones((100, 100)))
    points = 0.3 + 0.5 * DX * (lattice + 0.25 + 0.5 * rng.random(lattice.shape))
    x.from_numpy((points - [0.0, 0.25]).astype(np.float32))
    F.from_numpy(np.tile(np.eye(2, dtype=np.float32), (N, 1, 1)))
    Jp.fill(0.0 if MATERIAL == "sand" else 1.0)
    substep()
    print("ready", flush=True)
    for line in sys.stdin:
        start = time.perf_counter()
        for _ in range(int(line)):
            substep()
        print(time.perf_counter() - start, flush=True)


if __name__ == "__main__":
    main()
