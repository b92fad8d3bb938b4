"""One scene of the 2D Material Point Method, complete in this file.

MLS-MPM [Hu et al. 2018] with APIC transfers [Jiang et al. 2015], quadratic B-splines.
`python program.py out.mp4` writes a preview; `frames()` yields the exact frames.

Vectors are complex numbers and a 2 x 2 matrix is a pair of them: M z = a z + b conj(z).
Then |a| + |b| and |a| - |b| are its singular values, a / |a| is its polar rotation. The
strain F is (a, b), the velocity gradient C is (c, d), a symmetric stress is (t, z).
"""

import sys

import cv2
import numpy as np
import taichi as ti
from taichi.math import cconj, cmul, vec2, vec3, vec4

SIMULATION = dict(
    grid_resolution=128,
    time_step_dt=0.00016666666666666666,
    substeps_per_frame=60,
    duration_frames=300,
    particles_per_cell=4,
    seed=3,
)
ENVIRONMENT = dict(
    gravity=[0.0, -9.8], walls=dict(contact="separate", friction=0.3, thickness_cells=6)
)
OBJECTS = [
    dict(
        name="object_0",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.5, 0.8], angle_deg=0.0, size=[0.58, 0.26]),
        physics_properties=dict(
            constitutive_model="sand",
            density=1600.0,
            youngs_modulus=640000.0,
            poissons_ratio=0.25,
            friction_angle_deg=32.0,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F5C22D"),
    ),
    dict(
        name="object_1",
        object_type="static_collider",
        shape=dict(
            type="polygon",
            center=[0.24, 0.55],
            angle_deg=0.0,
            vertices=[[-0.22, 0.2], [-0.22, 0.12], [0.21, -0.11], [0.23, -0.06]],
        ),
        contact=dict(type="separate", friction=0.3, skin_cells=0.3),
        visualization=dict(color="#969696"),
    ),
    dict(
        name="object_2",
        object_type="static_collider",
        shape=dict(
            type="polygon",
            center=[0.76, 0.55],
            angle_deg=0.0,
            vertices=[[0.22, 0.2], [0.22, 0.12], [-0.21, -0.11], [-0.23, -0.06]],
        ),
        contact=dict(type="separate", friction=0.3, skin_cells=0.3),
        visualization=dict(color="#969696"),
    ),
    dict(
        name="object_3",
        object_type="static_collider",
        shape=dict(
            type="polygon",
            center=[0.5, 0.12],
            angle_deg=0.0,
            vertices=[[-0.12, -0.08], [0.12, -0.08], [0.0, 0.1]],
        ),
        contact=dict(type="separate", friction=0.3, skin_cells=0.3),
        visualization=dict(color="#912CF4"),
    ),
]
OUTPUT = dict(resolution=512, framerate=30)

DT = SIMULATION["time_step_dt"]
N_GRID = SIMULATION["grid_resolution"]
DX = 1.0 / N_GRID
SPACING = DX / SIMULATION["particles_per_cell"] ** 0.5  # of particles at rest
AREA = SPACING**2  # of a particle at rest: its volume per unit thickness
GRAVITY = ENVIRONMENT["gravity"]
WALLS = ENVIRONMENT["walls"]
EDGE = DX * WALLS["thickness_cells"]
LAWS = {"sticky": 0, "slip": 1, "separate": 2}
PIXELS = OUTPUT["resolution"]
BLOB = 2.3 * SPACING  # radius of the metaball that a particle is drawn as
CORE = 0.06  # part of the area of a metaball that is covered in any case
SOLID = 0.4 * np.pi * 2.3**2 / 3  # sum that covers: 0.4 of the mean inside matter

ti.init(
    arch=ti.cpu,
    cpu_max_num_threads=1,  # so that every run gives the same bits
    fast_math=False,
    cfg_optimization=False,  # it compiles a quarter faster and runs as fast
    log_level=ti.WARN,
)
SERIAL = ti.cfg.arch in (ti.x64, ti.arm64)  # on a GPU the same loops run in parallel
ARRAY = ti.types.ndarray()

N_OBJECTS = len(OBJECTS)
SHAPES = [o["shape"] for o in OBJECTS]
HOME = [[*s["center"], np.radians(s.get("angle_deg", 0.0))] for s in SHAPES]
MATTER = [o.get("physics_properties", {}) for o in OBJECTS]
MODEL = [m.get("constitutive_model") for m in MATTER]
GRAINS = [k for k in range(N_OBJECTS) if MODEL[k] not in (None, "rigid")]
BODIES = [k for k in GRAINS if OBJECTS[k]["object_type"] == "dynamic_body"]
COLLIDERS = [k for k in range(N_OBJECTS) if k not in GRAINS]
MOTION = [
    o.get("kinematics", {"type": MODEL[k]})["type"] for k, o in enumerate(OBJECTS)
]
STILL = [k for k in COLLIDERS if MOTION[k] in (None, "conveyor")]  # never change place
COLLIDERS, N_STILL = STILL + [k for k in COLLIDERS if k not in STILL], len(STILL)


@ti.func
def advance(a, b, c, d, dt):
    """F <- (I + dt C) F for F = (a, b) and velocity gradient C = (c, d) [1/s]."""
    da = cmul(c, a) + cmul(d, cconj(b))
    db = cmul(c, b) + cmul(d, cconj(a))
    return a + dt * da, b + dt * db


@ti.func
def bspline(f):
    """Weights of 3 nodes per axis, for offset f in [0.5, 1.5) cells from the first."""
    return 0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2


@ti.func
def hencky(a, b):
    """Mean m and half difference g >= 0 of the log strains of F = (a, b).

    Singular values below 0.05, and those of an inverted F, count as 0.05.
    """
    A, B = a.norm(), b.norm()
    e1, e2 = ti.log(ti.max(A + B, 0.05)), ti.log(ti.max(A - B, 0.05))
    return 0.5 * (e1 + e2), 0.5 * (e1 - e2)


@ti.func
def hencky_stress(a, b, m, g, mu, lam):
    """Kirchhoff stress t, z of log strains m + g, m - g along the axes of F = (a, b).

    tau = 2 mu e + lam tr(e) I; its mean is 2 (mu + lam) m, its largest shear 2 mu g.
    """
    AB = ti.max(a.norm() * b.norm(), 1e-12)
    return 2.0 * (mu + lam) * m, 2.0 * mu * g / AB * cmul(a, b)


@ti.func
def loosen(m, q, most):
    """Matter that parts where the mean log strain m passes `most`: new m and q.

    The log volume beyond, q - 1, is no strain; it is undone before matter resists
    again, so that parting gains no volume [Tampubolon et al. 2017].
    """
    new_m = m + 0.5 * (q - 1.0)
    return ti.min(new_m, most), 1.0 + 2.0 * ti.max(new_m - most, 0.0)


@ti.func
def restretch(a, b, s1, s2):
    """F = (a, b) with its singular values replaced by s1 >= s2, rotations kept."""
    new_a = a * (0.5 * (s1 + s2) / ti.max(a.norm(), 1e-9))
    new_b = b * (0.5 * (s1 - s2) / ti.max(b.norm(), 1e-9))
    return new_a, new_b


@ti.func
def hencky_sand(a, b, q, mu, lam, phi, bond):
    """Return-map F to the Mohr-Coulomb cone: new F and q, Kirchhoff stress t, z.

    |z| <= bond cos(phi) - t sin(phi) in the plane, for friction angle phi and cohesion
    `bond` [Pa]. At the tip of the cone, where t = bond / tan(phi), grains part.
    """
    m, g = hencky(a, b)
    slope = ti.sin(phi) * (mu + lam)
    tip = 0.5 * bond * ti.cos(phi) / slope
    m, new_q = loosen(m, q, tip)
    g = ti.min(g, slope / mu * (tip - m))
    new_a, new_b = restretch(a, b, ti.exp(m + g), ti.exp(m - g))
    t, z = hencky_stress(a, b, m, g, mu, lam)
    return new_a, new_b, new_q, t, z


@ti.func
def lame(E, nu):
    """Lame parameters mu, lam [Pa] of Young's modulus E [Pa], Poisson's ratio nu."""
    mu = 0.5 * E / (1.0 + nu)
    return mu, 2.0 * mu * nu / (1.0 - 2.0 * nu)


@ti.func
def sd_box(p, size):
    """Box of width and height `size` [m] around the origin."""
    q = abs(p) - 0.5 * vec2(size)
    side = ti.select(p < 0.0, -1.0, 1.0)
    out = ti.max(q, 0.0)
    far = out.norm()
    n = side * vec2(ti.select(q.x > q.y, 1.0, 0.0), ti.select(q.x > q.y, 0.0, 1.0))
    if far > 0.0:
        n = side * out / far
    return vec3(far + ti.min(q.max(), 0.0), n)


@ti.func
def sd_polygon(p, corners: ti.template(), k, count):
    """Simple polygon whose `count` corners [m] are row k of a field, in any winding."""
    nearest, inside, start = vec2(1e9, 0.0), 1.0, corners[k, count - 1]
    for i in range(count):
        end = corners[k, i]
        edge, w = end - start, p - start
        w -= edge * ti.min(ti.max(w.dot(edge) / edge.dot(edge), 0.0), 1.0)
        if w.dot(w) < nearest.dot(nearest):
            nearest = w
        if (start.y > p.y) != (end.y > p.y):
            if p.x < start.x + (p.y - start.y) * edge.x / edge.y:
                inside = -inside
        start = end
    d = nearest.norm()
    return vec3(inside * d, inside * nearest / ti.max(d, 1e-9))


@ti.func
def touch(v, surface_v, n, law, friction):
    """Velocity v after contact with a surface of normal n that moves at surface_v.

    law: 0 sticky; 1 slip, no normal motion; 2 separate, no motion inwards. What the
    surface takes from the normal part bounds Coulomb friction on the tangential part.
    """
    u = v - surface_v
    normal = u.dot(n)
    if law == 0:
        u = vec2(0.0)
    elif law == 1 or normal < 0.0:
        u -= normal * n
        speed = u.norm()
        u *= ti.max(1.0 - friction * ti.max(-normal, 0.0) / ti.max(speed, 1e-9), 0.0)
    return surface_v + u


pose = ti.Vector.field(4, ti.f32, N_OBJECTS + 1)  # center x, y [m]; cos, sin of angle
kind = ti.field(ti.i32, N_OBJECTS)  # of shape, index in KINDS
measure = ti.Vector.field(4, ti.f32, N_OBJECTS)  # of the shape; radius around it [m]
corners = ti.Vector.field(2, ti.f32, (N_OBJECTS, 24))  # of polygons [m]
N_COLLIDERS = len(COLLIDERS)
collider = ti.field(ti.i32, N_COLLIDERS)  # index of the object
contact = ti.Vector.field(3, ti.f32, N_COLLIDERS)  # law; friction; skin [m]
twist = ti.Vector.field(4, ti.f32, N_OBJECTS + 1)  # velocity [m/s]; spin; belt [m/s]

KINDS = dict(box=0, polygon=1)


def measures(shape):
    """Numbers of a shape for its distance, and the radius around it [m]."""
    if shape["type"] == "box":
        reach = np.hypot(*shape["size"]) / 2
        return [*shape["size"], 0, reach]
    reach = max(np.hypot(*vertex) for vertex in shape["vertices"])
    return [len(shape["vertices"]), 0, 0, reach]


@ti.func
def distance(k, p):
    """Signed distance [m] and normal of object k at p, in its own frame."""
    m = measure[k]
    s = vec3(0.0)
    if kind[k] == 0:
        s = sd_box(p, m.xy)
    elif kind[k] == 1:
        s = sd_polygon(p, corners, k, int(m.x))
    return s


@ti.func
def surface(k, p):
    """Signed distance [m] of p from object k, 1 m from afar, and outward normal."""
    s, arm, turn = vec3(1.0, 0.0, 0.0), p - pose[k].xy, pose[k].zw
    if arm.norm_sqr() < (measure[k].w + 2.0 * DX) ** 2:
        s = distance(k, cmul(arm, cconj(turn)))
        s = vec3(s.x, cmul(turn, s.yz))
    return s


@ti.kernel
def set_up(kinds: ARRAY, home: ARRAY, sizes: ARRAY, vertices: ARRAY, touching: ARRAY):
    """Enter place and shape of every object, and the contact of colliders."""
    for k in range(N_OBJECTS):
        pose[k] = vec4(home[k, 0], home[k, 1], ti.cos(home[k, 2]), ti.sin(home[k, 2]))
        measure[k] = vec4(sizes[k, 0], sizes[k, 1], sizes[k, 2], sizes[k, 3])
        kind[k] = kinds[k]
        for i in range(vertices.shape[1]):
            corners[k, i] = vec2(vertices[k, i, 0], vertices[k, i, 1])
    for n in range(N_COLLIDERS):
        k = int(touching[n, 0])
        collider[n], twist[k] = k, vec4(0.0)
        contact[n] = vec3(touching[n, 1], touching[n, 2], touching[n, 3])


SIZES, SORTS = [*map(measures, SHAPES)], [KINDS[shape["type"]] for shape in SHAPES]
VERTICES, TOUCHING = np.zeros((N_OBJECTS, 24, 2)), np.zeros((1, 4))
for k in range(N_OBJECTS):
    rows = SHAPES[k].get("vertices", [])
    VERTICES[k, : len(rows)] = np.reshape(rows, (-1, 2))
TOUCH = [OBJECTS[k].get("contact", {"type": "separate"} | MATTER[k]) for k in COLLIDERS]
TOUCHING = [[LAWS[c["type"]], c["friction"], DX * c["skin_cells"]] for c in TOUCH]
TOUCHING = np.column_stack([COLLIDERS, TOUCHING])
TABLES = [np.int32(SORTS), *map(np.float32, (HOME, SIZES, VERTICES, TOUCHING))]
set_up(*TABLES)


@ti.kernel
def probe(k: int, points: ARRAY, found: ARRAY):
    """Signed distance [m] of points from object k, and its normals."""
    ti.loop_config(serialize=SERIAL)
    for p in range(points.shape[0]):
        s = surface(k, vec2(points[p, 0], points[p, 1]))
        found[p, 0], found[p, 1], found[p, 2] = s.x, s.y, s.z


def nearest(points):
    """Distance [m], normal and number of the still collider nearest to each point."""
    found, here = np.float32([[1, 0, 0, 0]] * len(points)), np.zeros((len(points), 3))
    here = here.astype(np.float32)
    for n, k in enumerate(STILL):
        probe(k, points.astype(np.float32), here)
        closer = here[:, 0] < found[:, 0]
        found[closer, :3], found[closer, 3] = here[closer], n
    return found


CORNERS = DX * np.argwhere(np.ones((N_GRID, N_GRID)))
still = ti.Vector.field(4, ti.f32, (N_GRID, N_GRID))  # what is nearest to each node
still.from_numpy(nearest(CORNERS).reshape(N_GRID, N_GRID, 4))
CENTERS = (np.argwhere(np.ones((PIXELS, PIXELS)))[:, ::-1] + 0.5) / PIXELS
FOUND = nearest(CENTERS * [1, -1] + [0, 1]).reshape(PIXELS, PIXELS, 4)
BACKDROP = np.where(FOUND[..., 0] < 0, np.add(STILL, 1)[FOUND[..., 3].astype(int)], 0)


def lattice(k, shake):
    """Points [m] of a lattice shaken by parts of it, their distances and normals."""
    rng = np.random.Generator(np.random.Philox(SIMULATION["seed"]))
    cells = np.argwhere(np.ones((round(1 / SPACING), round(1 / SPACING))))
    points = SPACING * (cells + 0.5 + shake * (rng.random(cells.shape) - 0.5))
    found = np.empty((len(points), 3), np.float32)
    probe(k, points.astype(np.float32), found)
    return points, found[:, 0], found[:, 1:]


none, nowhere = np.zeros(0), np.zeros((0, 2))
GROUPS = [(none, none, nowhere, nowhere, none)]  # object, birth, place, velocity, spin
for k in BODIES:
    points, depth, _ = lattice(k, 0.0 if MODEL[k] == "elastic_fem" else 0.5)
    place, state = points[depth < 0.0], OBJECTS[k]["initial_state"]
    spin, none = state["angular_velocity"], np.zeros(len(place))
    arm = (place - HOME[k][:2])[:, ::-1] * [-1, 1]  # turned by 90 degrees
    GROUPS.append((k + none, none, place, state["velocity"] + spin * arm, spin + none))
OWNER, BIRTH, PLACE, SPEED, SPIN = map(np.concatenate, zip(*GROUPS, strict=True))
ORDER = np.argsort(BIRTH, kind="stable")  # so that the living come first
OWNER, BIRTH = OWNER[ORDER].astype(np.int32), BIRTH[ORDER].astype(np.int32)
START = np.column_stack([PLACE, SPEED, SPIN])[ORDER].astype(np.float32)
N_PARTICLES = len(ORDER)

x, v, c, d, a, b = (ti.Vector.field(2, ti.f32) for _ in range(6))
q, owner = ti.field(ti.f32), ti.field(ti.i32)  # state, 1 at rest; object
ti.root.dense(ti.i, max(N_PARTICLES, 1)).place(x, v, c, d, a, b, q, owner)
grid = ti.Vector.field(4, ti.f32, (N_GRID, N_GRID))  # momentum or velocity; mass; area
birth = ti.field(ti.i32, max(N_PARTICLES, 1))  # substep
clock, alive = ti.field(ti.i32, ()), ti.field(ti.i32, ())  # substeps; particles


@ti.func
def count_living():
    """Let those particles live whose birth has come."""
    while alive[None] < N_PARTICLES and birth[alive[None]] <= clock[None]:
        alive[None] += 1


@ti.kernel
def give_birth(start: ARRAY, births: ARRAY, owners: ARRAY):
    """Put every particle where it will be born, without strain."""
    clock[None], alive[None] = 0, 0
    for p in range(N_PARTICLES):
        x[p], v[p] = vec2(start[p, 0], start[p, 1]), vec2(start[p, 2], start[p, 3])
        c[p], d[p] = vec2(0.0, start[p, 4]), vec2(0.0)
        a[p], b[p], q[p] = vec2(1.0, 0.0), vec2(0.0), 1.0
        birth[p], owner[p] = births[p], owners[p]
    count_living()


@ti.func
def velocity(k, p, n):
    """Velocity [m/s] of the surface of collider k at p, where its normal is n."""
    arm, belt = p - pose[k].xy, twist[k].w * vec2(n.y, -n.x)
    return twist[k].xy + cmul(vec2(0.0, twist[k].z), arm) + belt


@ti.func
def stress(p, m: ti.template()):
    """Strain particle p of material m for a step; Kirchhoff stress [Pa]."""
    t, z = 0.0, vec2(0.0)
    mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
    phi = ti.math.radians(m["friction_angle_deg"])
    a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
    a[p], b[p], q[p], t, z = hencky_sand(a[p], b[p], q[p], mu, lam, phi, 0.0)
    return t, z


@ti.kernel
def particles_to_grid():
    """Scatter mass, momentum and the impulse of stress."""
    count_living()
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(N_GRID, N_GRID):
        grid[i, j] = vec4(0.0)
    ti.loop_config(serialize=SERIAL)
    for p in range(alive[None]):
        m, t, z = 0.0, 0.0, vec2(0.0)
        for k in ti.static(GRAINS):
            if owner[p] == k:
                m = AREA * MATTER[k]["density"]
                t, z = stress(p, MATTER[k])
        impulse = -4.0 * DT * AREA / DX
        ma, mb = m * DX * c[p] + vec2(impulse * t, 0.0), m * DX * d[p] + impulse * z
        right = vec4(ma + mb, 0.0, 0.0)  # what a node more to the right gets
        up = vec4(cmul(vec2(0.0, 1.0), ma - mb), 0.0, 0.0)
        base = ti.floor(N_GRID * x[p] - 0.5, ti.i32)
        f = N_GRID * x[p] - base
        w = bspline(f)
        row = vec4(m * v[p], m, AREA) - f.x * right - f.y * up  # at the first node
        for i in ti.static(range(3)):
            node = w[i].x * row
            for j in ti.static(range(3)):
                grid[base.x + i, base.y + j] += w[j].y * node
                node += w[i].x * up
            row += right


@ti.kernel
def update_grid():
    """Turn momentum into velocity a step later, with gravity and contact."""
    clock[None] += 1
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(N_GRID, N_GRID):
        m, node = grid[i, j].z, DX * vec2(i, j)
        if m > 0.0:
            g = grid[i, j].xy / m + DT * vec2(GRAVITY)
            s, near = still[i, j].xyz, int(still[i, j].w)
            if s.x < contact[near].z:
                u = velocity(collider[near], node, s.yz)
                g = touch(g, u, s.yz, contact[near].x, contact[near].y)
            for axis in ti.static(range(2)):
                edge = ti.select(node[axis] < 0.5, node[axis], 1.0 - node[axis])
                if edge < EDGE + 0.3 * DX:  # a skin, so that the node on the wall acts
                    n = ti.select(node[axis] < 0.5, 1.0, -1.0) * vec2(1 - axis, axis)
                    law = LAWS[WALLS["contact"]]
                    g = touch(g, vec2(0.0), n, law, WALLS["friction"])
            grid[i, j].xy = g


@ti.kernel
def grid_to_particles():
    """Gather velocity and its gradient, and move."""
    ti.loop_config(serialize=SERIAL)
    for p in range(alive[None]):
        base = ti.floor(N_GRID * x[p] - 0.5, ti.i32)
        f = N_GRID * x[p] - base
        w = bspline(f)
        sums, lifts = [vec4(0.0)] * 3, [vec4(0.0)] * 3  # over j of w g and of j w g
        for i in ti.static(range(3)):
            low, mid, high = [w[j].y * grid[base.x + i, base.y + j] for j in range(3)]
            sums[i], lifts[i] = low + mid + high, mid + 2.0 * high
        u = w[0].x * sums[0] + w[1].x * sums[1] + w[2].x * sums[2]
        east = (w[1].x * sums[1] + 2.0 * w[2].x * sums[2]).xy
        north = (w[0].x * lifts[0] + w[1].x * lifts[1] + w[2].x * lifts[2]).xy
        east, north = 4.0 / DX * (east - f.x * u.xy), 4.0 / DX * (north - f.y * u.xy)
        down = vec2(north.y, -north.x)  # -i d/dy, so that d/dx = c + d and d/dy = ..
        v[p], c[p], d[p] = u.xy, 0.5 * (east + down), 0.5 * (east - down)
        moved = x[p] + DT * u.xy
        first, last = N_STILL, N_STILL  # of the colliders that are near
        if still[base + 1].x < 2.0 * DX:
            first = 0
        for n in range(first, last):  # thin and fast ones overtake particles
            s = surface(collider[n], moved)
            moved -= ti.min(s.x, 0.0) * s.yz
        x[p] = ti.min(ti.max(moved, 2.0 * DX), 1.0 - 2.0 * DX)


blobs = ti.field(ti.f32, (PIXELS, PIXELS, N_OBJECTS))  # metaballs of each object
COLORS = [bytes.fromhex(o["visualization"]["color"][1:]) for o in OBJECTS]
COLORS = np.array([[0, 0, 0], *map(list, COLORS)], np.uint8)


@ti.kernel
def draw(image: ti.types.ndarray(dtype=ti.u8, ndim=2)):
    """Write the index in COLORS of each pixel; the top row comes first."""
    ti.loop_config(serialize=SERIAL)
    for p in range(alive[None]):
        low = ti.max(ti.floor((x[p] - BLOB) * PIXELS, ti.i32), 0)
        high = ti.min(ti.ceil((x[p] + BLOB) * PIXELS, ti.i32), PIXELS)
        for i in range(low.x, high.x):
            for j in range(low.y, high.y):
                r2 = ((vec2(i, j) + 0.5) / PIXELS - x[p]).norm_sqr() * BLOB**-2
                ball = ti.max(1.0 - r2, 0.0) ** 2
                blobs[i, j, owner[p]] += ti.select(r2 < CORE, ball + SOLID, ball)
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(PIXELS, PIXELS):
        most, seen = SOLID, 0
        for k in range(N_OBJECTS):
            if blobs[i, j, k] > most:
                most, seen = blobs[i, j, k], k + 1
            blobs[i, j, k] = 0.0
        image[PIXELS - 1 - j, i] = ti.cast(seen, ti.u8)


def simulate():
    """The substeps of a frame, as a graph that runs without Python in between."""
    stages = [particles_to_grid, update_grid]
    builder = ti.graph.GraphBuilder()
    substep = builder.create_sequential()
    for stage in [*stages, grid_to_particles]:
        substep.dispatch(stage)
    for _ in range(SIMULATION["substeps_per_frame"]):
        builder.append(substep)
    return builder.compile()


def frames():
    """Yield the frames of the video, each uint8 RGB of shape (PIXELS, PIXELS, 3)."""
    set_up(*TABLES)
    give_birth(START, BIRTH, OWNER)
    image, frame = np.zeros((PIXELS, PIXELS), np.uint8), simulate()
    for n in range(SIMULATION["duration_frames"]):
        if n:
            frame.run({})
        draw(image)
        image[BACKDROP > 0] = BACKDROP[BACKDROP > 0]
        yield COLORS[image]


if __name__ == "__main__":
    codec, size = cv2.VideoWriter_fourcc(*"mp4v"), (PIXELS, PIXELS)
    video = cv2.VideoWriter(sys.argv[1], codec, OUTPUT["framerate"], size)
    for frame in frames():
        video.write(frame[:, :, ::-1])
    video.release()
