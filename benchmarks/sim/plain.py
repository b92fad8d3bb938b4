"""Plain MLS-MPM programs in the style of Taichi's mpm128 example: the yardstick.

What is written when nobody measures: parallel loops, one time step for all, an SVD for
every particle and step, distances and normals by finite differences at every node and
step, rigid bodies of stiff rubber, a circle drawn for every particle. `SCENE` is the
material of a falling block, or one of five seeds; `plain(scene)` is the text for it.

Run as `program.py THREADS`, it answers each line on standard input, a number of
substeps, with the seconds that they took. `frames()` yields pictures.
"""

import os
import sys
import time

import cv2
import numpy as np
import taichi as ti

SCENE = "liquid"
THREADS = int(sys.argv[1]) if len(sys.argv) == 2 else os.cpu_count() or 1
ti.init(arch=ti.cpu, cpu_max_num_threads=THREADS, log_level=ti.ERROR)

N_GRID, DT, SUBSTEPS, WALL, PIXELS = 128, 1e-4, 100, 3, 512
DX = 1.0 / N_GRID
VOLUME = (0.5 * DX) ** 2
ALPHA = np.sin(np.radians(35.0)) / np.sqrt(2.0)
YIELD = 60.0  # Pa, of paste

# Materials: density, Young's modulus (of liquid: so that the bulk modulus is right)
LIQUID, ELASTIC, SNOW, SAND, PASTE = range(5)
DENSITY = [1000.0, 1000.0, 400.0, 1600.0, 1200.0]
YOUNG = [4e5, 4e5, 6e4, 8e5, 3e5]

# Bodies: material, shape (box or circle), center, size, angle, color
GOLD, BLUE, PINK, GREY, GREEN = (
    (245, 194, 45), (44, 144, 245), (244, 44, 194), (150, 150, 150), (94, 245, 44)
)  # fmt: skip
BLOCK = ("box", (0.4953, 0.2453), (0.390625, 0.390625), 0.0, BLUE)
BODIES = {
    "liquid": [(LIQUID, *BLOCK)],
    "elastic": [(ELASTIC, *BLOCK)],
    "snow": [(SNOW, *BLOCK)],
    "sand": [(SAND, *BLOCK)],
    "s02": [(SAND, "box", (0.5, 0.8), (0.58, 0.26), 0.0, GOLD)],
    "s07": [
        (ELASTIC, "circle", (0.2, 0.6), (0.14, 0.14), 0.0, GOLD),
        (ELASTIC, "circle", (0.8, 0.75), (0.14, 0.14), 0.0, PINK),
    ],
    "s12": [(ELASTIC, "box", (0.6, 0.8), (0.14, 0.1), 20.0, GOLD)],
    "s19": [
        (LIQUID, "box", (0.161875, 0.151875), (0.23, 0.21), 0.0, BLUE),
        (SAND, "box", (0.838125, 0.136875), (0.23, 0.18), 0.0, GOLD),
        (SNOW, "circle", (0.24, 0.74), (0.18, 0.18), 0.0, (255, 255, 255)),
        (ELASTIC, "box", (0.48, 0.82), (0.14, 0.14), 25.0, GREEN),
        (PASTE, "circle", (0.75, 0.7), (0.2, 0.2), 0.0, PINK),
    ],
    "s25": [
        (ELASTIC, "box", (0.3, 0.86), (0.16, 0.09), 20.0, GOLD),
        (ELASTIC, "circle", (0.55, 0.84), (0.13, 0.13), 0.0, BLUE),
        (ELASTIC, "box", (0.77, 0.8), (0.12, 0.12), 10.0, PINK),
    ],
}
# Jets of liquid: center, size, velocity, particles a second, end [s]
JETS = {
    "s07": ((0.5, 0.2), (0.036, 0.03), (0.0, 3.2), 6200.0, 2.4),
    "s12": ((0.27, 0.92), (0.032, 0.04), (0.0, -2.4), 4300.0, 2.7),
}
# Solids: shape, center, its figures, spin [rad/s], amplitude and frequency up and down
FUNNEL = [(-0.22, 0.2), (-0.22, 0.12), (0.21, -0.11), (0.23, -0.06)]
STILL = (0.0, 0.0, 0.0)
SOLIDS = {
    "s02": [
        ("polygon", (0.24, 0.55), FUNNEL, *STILL),
        ("polygon", (0.76, 0.55), [(-a, b) for a, b in reversed(FUNNEL)], *STILL),
        ("polygon", (0.5, 0.12), [(-0.12, -0.08), (0.12, -0.08), (0.0, 0.1)], *STILL),
    ],
    "s07": [
        (
            "polygon",
            (0.5, 0.08),
            [(-0.1, -0.06), (0.1, -0.06), (0.05, 0.08), (-0.05, 0.08)],
            *STILL,
        )
    ],
    "s12": [("blades", (0.44, 0.36), (4, 0.2, 0.04), 4.0, 0.0, 0.0)],
    "s19": [("blades", (0.5, 0.29), (3, 0.21, 0.035), 4.0, 0.0, 0.0)],
    "s25": [
        ("circle", (0.24, 0.55), (0.05,), *STILL),
        ("blades", (0.58, 0.52), (2, 0.1, 0.036), 4.0, 0.0, 0.0),
        ("box", (0.5, 0.08), (0.9, 0.04), 0.0, 0.05, 3.2),
    ],
}.get(SCENE, [])

rng = np.random.default_rng(0)
places, kinds, colors = [], [], []
for material, shape, center, size, angle, color in BODIES[SCENE]:
    cells = np.mgrid[:256, :256].reshape(2, -1).T
    points = 0.5 * DX * (cells + 0.25 + 0.5 * rng.random(cells.shape))
    turn = np.radians(angle)
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    away = (points - center) @ turned / np.divide(size, 2.0)
    if shape == "box":
        inside = abs(away).max(axis=1) < 1.0
    else:
        inside = np.hypot(*away.T) < 1.0
    places.append(points[inside])
    kinds += [material] * inside.sum()
    colors += [color] * inside.sum()
N_BODIES = len(kinds)
if SCENE in JETS:
    center, size, speed, rate, stop = JETS[SCENE]
    places.append(center + (rng.random((int(rate * stop), 2)) - 0.5) * size)
    kinds += [LIQUID] * int(rate * stop)
    colors += [BLUE] * int(rate * stop)
N = len(kinds)

x = ti.Vector.field(2, ti.f32, N)
v = ti.Vector.field(2, ti.f32, N)
C = ti.Matrix.field(2, 2, ti.f32, N)
F = ti.Matrix.field(2, 2, ti.f32, N)
Jp = ti.field(ti.f32, N)
kind = ti.field(ti.i32, N)
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
def liquid(p, mu, lam):
    """Volume only: F stays isotropic."""
    J = F[p].determinant()
    identity = ti.Matrix.identity(ti.f32, 2)
    F[p] = ti.sqrt(J) * identity
    return lam * J * (J - 1.0) * identity


@ti.func
def snow(p, mu, lam):
    """Singular values clamped, hardening."""
    U, sig, V = ti.svd(F[p])
    for d in ti.static(range(2)):
        kept = ti.min(ti.max(sig[d, d], 1.0 - 2.5e-2), 1.0 + 4.5e-3)
        Jp[p] *= sig[d, d] / kept
        sig[d, d] = kept
    F[p] = U @ sig @ V.transpose()
    h = ti.min(ti.max(ti.exp(10.0 * (1.0 - Jp[p])), 0.1), 5.0)
    return corotated(p, mu * h, lam * h)


@ti.func
def hencky(p, mu, lam, U, e, V):
    """Strain and stress of logarithms of the principal stretches."""
    sig, tau = ti.Matrix.zero(ti.f32, 2, 2), ti.Matrix.zero(ti.f32, 2, 2)
    for d in ti.static(range(2)):
        sig[d, d] = ti.exp(e[d])
        tau[d, d] = 2.0 * mu * e[d] + lam * (e[0] + e[1])
    F[p] = U @ sig @ V.transpose()
    return U @ tau @ U.transpose()


@ti.func
def sand(p, mu, lam):
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
        excess = size + (lam + mu) / mu * trace * ALPHA
        if excess > 0.0:
            e -= excess * dev / size
    return hencky(p, mu, lam, U, e, V)


@ti.func
def paste(p, mu, lam):
    """Hencky strain, von Mises cylinder."""
    U, sig, V = ti.svd(F[p])
    e = ti.Vector([ti.log(ti.max(sig[d, d], 0.05)) for d in range(2)])
    dev = e - 0.5 * (e[0] + e[1])
    size = dev.norm() + 1e-20
    e -= ti.max(size - YIELD / (2.0 * mu), 0.0) * dev / size
    return hencky(p, mu, lam, U, e, V)


@ti.func
def box(q, half):
    """Signed distance of a box."""
    d = ti.abs(q) - half
    return ti.max(d, 0.0).norm() + ti.min(ti.max(d[0], d[1]), 0.0)


@ti.func
def polygon(q, corners: ti.template()):
    """Signed distance of a polygon."""
    nearest, inside = 1e9, False
    for k in ti.static(range(len(corners))):
        a, b = ti.Vector(corners[k]), ti.Vector(corners[k - 1])
        edge, w = b - a, q - a
        along = ti.min(ti.max(w.dot(edge) / edge.dot(edge), 0.0), 1.0)
        nearest = ti.min(nearest, (w - along * edge).norm())
        if (a[1] > q[1]) != (b[1] > q[1]):
            if q[0] < (b[0] - a[0]) * (q[1] - a[1]) / (b[1] - a[1]) + a[0]:
                inside = not inside
    return ti.select(inside, -nearest, nearest)


@ti.func
def solid(k: ti.template(), p, t):
    """Signed distance of a solid at a time."""
    shape, center, figures, spin, amplitude, frequency = ti.static(SOLIDS[k])
    q = p - ti.Vector(center)
    q[1] -= amplitude * ti.sin(2.0 * np.pi * frequency * t - 0.5 * np.pi)
    c, s = ti.cos(spin * t), ti.sin(spin * t)
    q = ti.Vector([c * q[0] + s * q[1], c * q[1] - s * q[0]])
    distance = 1e9
    if ti.static(shape == "polygon"):
        distance = polygon(q, figures)
    elif ti.static(shape == "circle"):
        distance = q.norm() - figures[0]
    elif ti.static(shape == "box"):
        distance = box(q, 0.5 * ti.Vector(figures))
    else:
        for blade in ti.static(range(figures[0])):
            a = 2.0 * np.pi * blade / figures[0]
            r = ti.Vector([c, s])
            r[0] = ti.cos(a) * q[0] + ti.sin(a) * q[1] - 0.5 * figures[1]
            r[1] = ti.cos(a) * q[1] - ti.sin(a) * q[0]
            half = 0.5 * ti.Vector([figures[1], figures[2]])
            distance = ti.min(distance, box(r, half))
    return distance


@ti.func
def collide(p, t, u):
    """Velocity of a node after contact with all solids."""
    for k in ti.static(range(len(SOLIDS))):
        if solid(k, p, t) < 0.0:
            h = 1e-3
            right, up = ti.Vector([h, 0.0]), ti.Vector([0.0, h])
            n = ti.Vector([
                solid(k, p + right, t) - solid(k, p - right, t),
                solid(k, p + up, t) - solid(k, p - up, t),
            ]).normalized(1e-9)  # fmt: skip
            spin, amplitude, frequency = ti.static(SOLIDS[k][3:])
            q = p - ti.Vector(SOLIDS[k][1])
            rate = 2.0 * np.pi * frequency
            rise = amplitude * rate * ti.cos(rate * t - 0.5 * np.pi)
            surface = ti.Vector([-spin * q[1], spin * q[0] + rise])
            u -= ti.min((u - surface).dot(n), 0.0) * n
    return u


@ti.kernel
def substep(count: int, t: float):
    for i, j in grid_m:
        grid_v[i, j] = [0.0, 0.0]
        grid_m[i, j] = 0.0
    for p in range(count):
        base = (x[p] / DX - 0.5).cast(int)
        fx = x[p] / DX - base.cast(float)
        w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1.0) ** 2, 0.5 * (fx - 0.5) ** 2]
        F[p] = (ti.Matrix.identity(ti.f32, 2) + DT * C[p]) @ F[p]
        stress, mass = ti.Matrix.zero(ti.f32, 2, 2), 0.0
        for k in ti.static(sorted(set(kinds))):
            if kind[p] == k:
                mu, lam = YOUNG[k] / 2.6, YOUNG[k] * 0.3 / (1.3 * 0.4)
                stress = ti.static([liquid, corotated, snow, sand, paste][k])(
                    p, mu, lam
                )
                mass = VOLUME * DENSITY[k]
        affine = -DT * VOLUME * 4.0 / DX**2 * stress + mass * C[p]
        for i, j in ti.static(ti.ndrange(3, 3)):
            offset = ti.Vector([i, j])
            dpos = (offset.cast(float) - fx) * DX
            weight = w[i][0] * w[j][1]
            grid_v[base + offset] += weight * (mass * v[p] + affine @ dpos)
            grid_m[base + offset] += weight * mass
    for i, j in grid_m:
        if grid_m[i, j] > 0.0:
            grid_v[i, j] = grid_v[i, j] / grid_m[i, j]
            grid_v[i, j][1] -= DT * 9.8
            grid_v[i, j] = collide(DX * ti.Vector([i, j]), t, grid_v[i, j])
            if i < WALL and grid_v[i, j][0] < 0.0:
                grid_v[i, j][0] = 0.0
            if i > N_GRID - WALL and grid_v[i, j][0] > 0.0:
                grid_v[i, j][0] = 0.0
            if j < WALL and grid_v[i, j][1] < 0.0:
                grid_v[i, j][1] = 0.0
            if j > N_GRID - WALL and grid_v[i, j][1] > 0.0:
                grid_v[i, j][1] = 0.0
    for p in range(count):
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


@ti.kernel
def draw_solids(image: ti.types.ndarray(), t: float):
    for i, j in ti.ndrange(PIXELS, PIXELS):
        for k in ti.static(range(len(SOLIDS))):
            p = ti.Vector([j + 0.5, PIXELS - i - 0.5]) / PIXELS
            if solid(k, p, t) < 0.0:
                for c in ti.static(range(3)):
                    image[i, j, c] = ti.cast(150, ti.u8)


def begin() -> None:
    """Put the particles in place."""
    x.from_numpy(np.concatenate(places).astype(np.float32))
    F.from_numpy(np.tile(np.eye(2, dtype=np.float32), (N, 1, 1)))
    kind.from_numpy(np.array(kinds, np.int32))
    Jp.from_numpy(np.where(np.array(kinds) == SAND, 0.0, 1.0).astype(np.float32))
    if SCENE in JETS:
        start = np.zeros((N, 2), np.float32)
        start[N_BODIES:] = JETS[SCENE][2]
        v.from_numpy(start)


def frames():
    """Yield the pictures, each uint8 RGB of shape (512, 512, 3)."""
    begin()
    count, step = N_BODIES, 0
    for n in range(300):
        for _ in range(SUBSTEPS if n else 0):
            t = step * DT
            if SCENE in JETS:
                count = min(N, N_BODIES + int(JETS[SCENE][3] * t))
            substep(count, t)
            step += 1
        image = np.zeros((PIXELS, PIXELS, 3), np.uint8)
        for p, (a, b) in enumerate(x.to_numpy()[:count] * PIXELS):
            at = (int(a), PIXELS - 1 - int(b))
            cv2.circle(image, at, 2, colors[p], -1)
        draw_solids(image, step * DT)
        yield image


def main() -> None:
    """Answer each number of substeps with the seconds they take."""
    begin()
    substep(N, 0.0)
    print("ready", flush=True)
    for line in sys.stdin:
        start = time.perf_counter()
        for _ in range(int(line)):
            substep(N, 0.0)
        print(time.perf_counter() - start, flush=True)


if __name__ == "__main__":
    main()
