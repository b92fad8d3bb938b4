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
    seed=13,
)
ENVIRONMENT = dict(
    gravity=[0.0, -9.8], walls=dict(contact="separate", friction=0.0, thickness_cells=6)
)
OBJECTS = [
    dict(
        name="object_0",
        object_type="emitter",
        shape=dict(type="box", center=[0.27, 0.92], angle_deg=0.0, size=[0.032, 0.04]),
        physics_properties=dict(
            constitutive_model="liquid",
            density=1000.0,
            bulk_modulus=500000.0,
            viscosity=0.05,
        ),
        emission=dict(
            type="jet", rate=4300.0, velocity=[0.0, -2.4], start=0.0, stop=2.7
        ),
        visualization=dict(color="#2CF4F4"),
    ),
    dict(
        name="object_1",
        object_type="kinematic_collider",
        shape=dict(
            type="fan_blades",
            center=[0.44, 0.36],
            angle_deg=0.0,
            blade_count=4,
            blade_length=0.2,
            thickness=0.04,
        ),
        kinematics=dict(type="rotate", angular_velocity=4.0, start=0.0, stop=100.0),
        contact=dict(type="separate", friction=0.1, skin_cells=0.3),
        visualization=dict(color="#F52C90"),
    ),
    dict(
        name="object_2",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.6, 0.8], angle_deg=20.0, size=[0.14, 0.1]),
        physics_properties=dict(
            constitutive_model="rigid",
            density=600.0,
            restitution=0.3,
            friction=0.3,
            skin_cells=0.3,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F5C22D"),
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
EMITTERS = [k for k in GRAINS if OBJECTS[k]["object_type"] == "emitter"]
COLLIDERS = [k for k in range(N_OBJECTS) if k not in GRAINS]
MOTION = [
    o.get("kinematics", {"type": MODEL[k]})["type"] for k, o in enumerate(OBJECTS)
]
STILL = [k for k in COLLIDERS if MOTION[k] in (None, "conveyor")]  # never change place
COLLIDERS, N_STILL = STILL + [k for k in COLLIDERS if k not in STILL], len(STILL)
LIQUIDS = [k for k in GRAINS if MODEL[k] == "liquid"]


@ti.func
def bspline(f):
    """Weights of 3 nodes per axis, for offset f in [0.5, 1.5) cells from the first."""
    return 0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2


@ti.func
def compress(J, c, dt, K):
    """Volume ratio J <- J (1 + dt tr C), and its stress tau = -J p for modulus K [Pa].

    p = K (1 - J), but no tension: free surfaces part [Tampubolon et al. 2017].
    """
    new_J = ti.min(ti.max(J * (1.0 + 2.0 * dt * c.x), 0.6), 1.1)
    return new_J, ti.min(K * new_J * (new_J - 1.0), 0.0)


@ti.func
def elapsed(t, motion: ti.template()):
    """Time [s] for which a motion has gone on at time t [s], and 1 while it does."""
    start, stop = motion["start"], motion["stop"]
    moving = ti.select(start <= t and t < stop, 1.0, 0.0)
    return ti.min(ti.max(t, start), stop) - start, moving


@ti.func
def cross(r, u):
    """Turning effect r x u of u at arm r."""
    return r.x * u.y - r.y * u.x


def jet(emission, width, spacing):
    """Births of a steady jet, on a lattice over time and place across the nozzle.

    Places are multiples of the golden ratio, modulo 1: for any count and any width, no
    two particles are near to each other and no gap is wide (a Kronecker sequence).
    """
    n = np.arange(round(emission["rate"] * (emission["stop"] - emission["start"])))
    time = emission["start"] + (n + 0.5) / emission["rate"]
    velocity = np.tile(emission["velocity"], (len(n), 1))
    across = velocity[:, ::-1] * [-1, 1] / np.hypot(*emission["velocity"])
    part = n * (5**0.5 - 1) / 2 % 1 - 0.5
    return time, width * part[:, None] * across, velocity


@ti.func
def newtonian(t, z, eta, c, d):
    """Add the viscous stress eta (C + C^T), eta [Pa s], to the stress t I + D(z)."""
    return t + 2.0 * eta * c.x, z + 2.0 * eta * d


@ti.func
def rotate(t, motion: ti.template()):
    """Displacement and rate at time t [s] of a constant angular_velocity [rad/s]."""
    time, moving = elapsed(t, motion)
    spin = vec3(0.0, 0.0, motion["angular_velocity"])
    return time * spin, moving * vec4(spin, 0.0)


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
def sd_fan(p, blade_count, blade_length, thickness):
    """Straight round-ended blades of the given length and thickness [m] from a hub."""
    sector = 2.0 * ti.math.pi / blade_count
    angle = sector * ti.round(ti.atan2(p.y, p.x) / sector)
    turn = vec2(ti.cos(angle), ti.sin(angle))
    q = cmul(p, cconj(turn))
    q.x -= ti.min(ti.max(q.x, 0.0), blade_length)
    r = q.norm()
    return vec3(r - 0.5 * thickness, cmul(turn, q) / ti.max(r, 1e-9))


@ti.func
def settle(J, crowd, dt):
    """Relax J within 5 ms where the space that is filled contradicts it.

    `crowd` is the part of space that matter and solids here would fill at rest.
    Splashing loses track of volume; liquid that is over a tenth thinner or denser than
    at rest returns to rest, and so keeps its volume [as in density correction].
    """
    rate = ti.select(abs(crowd - 1.0) > 0.1, dt / 0.005, 0.0)
    return J + rate * (ti.min(ti.max(1.0 / crowd, 0.8), 1.1) - J)


@ti.func
def strike(u, n, r, s, w, restitution, friction):
    """Impulse [kg m/s] that stops a body from meeting another with velocity u [m/s].

    n: normal of the contact; r, s: its arm [m] from the body and from the other; w:
    1 / mass and 1 / inertia of the body, then of the other. Coulomb friction takes at
    most what the normal part allows; contacts slower than 0.1 m/s do not bounce.
    """
    impulse = 0.0 * n
    approach = -u.dot(n)
    if approach > 0.0:
        t = ti.Vector([n.y, -n.x])
        loose = w.x + w.z  # inverse of the mass that feels the impulse
        loose_n = loose + w.y * cross(r, n) ** 2 + w.w * cross(s, n) ** 2
        loose_t = loose + w.y * cross(r, t) ** 2 + w.w * cross(s, t) ** 2
        normal = approach * ti.select(approach > 0.1, 1.0 + restitution, 1.0) / loose_n
        most = friction * normal
        impulse = normal * n - t * ti.min(ti.max(u.dot(t) / loose_t, -most), most)
    return impulse


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
N_COLLIDERS = len(COLLIDERS)
collider = ti.field(ti.i32, N_COLLIDERS)  # index of the object
contact = ti.Vector.field(3, ti.f32, N_COLLIDERS)  # law; friction; skin [m]
twist = ti.Vector.field(4, ti.f32, N_OBJECTS + 1)  # velocity [m/s]; spin; belt [m/s]
room = ti.field(ti.f32, (N_GRID, N_GRID))  # distance to what moves [m]

KINDS = dict(box=0, fan_blades=1)


def measures(shape):
    """Numbers of a shape for its distance, and the radius around it [m]."""
    if shape["type"] == "box":
        reach = np.hypot(*shape["size"]) / 2
        return [*shape["size"], 0, reach]
    reach = shape["blade_length"] + shape["thickness"] / 2
    return [shape["blade_count"], shape["blade_length"], shape["thickness"], reach]


@ti.func
def distance(k, p):
    """Signed distance [m] and normal of object k at p, in its own frame."""
    m = measure[k]
    s = vec3(0.0)
    if kind[k] == 0:
        s = sd_box(p, m.xy)
    elif kind[k] == 1:
        s = sd_fan(p, m.x, m.y, m.z)
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
    for n in range(N_COLLIDERS):
        k = int(touching[n, 0])
        collider[n], twist[k] = k, vec4(0.0)
        contact[n] = vec3(touching[n, 1], touching[n, 2], touching[n, 3])


SIZES, SORTS = [*map(measures, SHAPES)], [KINDS[shape["type"]] for shape in SHAPES]
VERTICES, TOUCHING = np.zeros((N_OBJECTS, 24, 2)), np.zeros((1, 4))
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
EMIT = dict(jet=jet)
for k in EMITTERS:
    emission = OBJECTS[k]["emission"]
    along = np.array(emission["velocity"]) / np.hypot(*emission["velocity"])
    sides = HOME[k][2] + np.array([0.0, np.pi / 2])
    width = abs(np.sin(sides) * along[0] - np.cos(sides) * along[1])
    width = width @ SHAPES[k]["size"]
    time, place, speed = EMIT[emission["type"]](emission, width, SPACING)
    birth, none = np.ceil(time / DT), np.zeros(len(time))
    place = HOME[k][:2] + place + speed * (birth * DT - time)[:, None]
    GROUPS.append((k + none, birth, place, speed, none))
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


MOVING = [k for k in COLLIDERS if OBJECTS[k]["object_type"] == "kinematic_collider"]


@ti.func
def move(k: ti.template(), motion: ti.template(), t):
    """Put collider k where its motion has it at time t [s]."""
    moved, rate = rotate(t, motion)
    now, twist[k] = vec3(HOME[k]) + moved, rate
    pose[k] = vec4(now.xy, ti.cos(now.z), ti.sin(now.z))


RIGID = [k for k in COLLIDERS if MODEL[k] == "rigid"]
WORLD = N_OBJECTS  # stands for the walls, which nothing moves
ease = ti.Vector.field(3, ti.f32, N_OBJECTS + 1)  # 1 / mass, 1 / inertia; restitution
kick = ti.Vector.field(3, ti.f32, N_OBJECTS)  # impulse of particles, and its moment


def weigh():
    """Of each rigid body: number, 1 / mass, 1 / inertia; points on its rim [m]."""
    for k in RIGID:
        points, depth, normal = lattice(k, 0.0)
        arms = (points - HOME[k][:2]) @ [1, 1j] * np.exp(-1j * HOME[k][2])
        normal = normal @ [1, 1j] * np.exp(-1j * HOME[k][2])
        moments = [(abs(arms[depth < 0.0]) ** n).sum() for n in (0, 2)]
        eases = 1.0 / (AREA * MATTER[k]["density"] * np.array(moments))
        yield k, eases, (arms - depth * normal)[abs(depth) < 0.5 * SPACING]


WEIGHED = [*weigh()]
RIM = [[k, z.real, z.imag] for k, _, points in WEIGHED for z in points]
rim = ti.Vector.field(3, ti.f32, len(RIM))  # object; a point in its frame [m]


@ti.kernel
def launch(states: ARRAY, rims: ARRAY):
    """Enter mass, restitution, motion and rim of rigid bodies."""
    ease.fill(0.0)
    for n in range(states.shape[0]):
        k = int(states[n, 0])
        ease[k], kick[k] = vec3(states[n, 1], states[n, 2], states[n, 3]), vec3(0.0)
        twist[k] = vec4(states[n, 4], states[n, 5], states[n, 6], 0.0)
    for i in range(rims.shape[0]):
        rim[i] = vec3(rims[i, 0], rims[i, 1], rims[i, 2])


LAUNCH = []
for k, eases, _ in WEIGHED:
    state, bounce = OBJECTS[k]["initial_state"], MATTER[k]["restitution"]
    LAUNCH.append([k, *eases, bounce, *state["velocity"], state["angular_velocity"]])
LAUNCH = np.float32(LAUNCH), np.float32(RIM)


@ti.func
def push(k, p, impulse):
    """Give body k an impulse [kg m/s] at p."""
    twist[k].xy += ease[k].x * impulse
    twist[k].z += ease[k].y * cross(p - pose[k].xy, impulse)


@ti.func
def meet(k, j, p, s, friction):
    """Keep body k at p out of object j, with signed distance and normal s there."""
    r, arm, n = p - pose[k].xy, p - pose[j].xy, s.yz
    u = velocity(k, p, n) - velocity(j, p, n)
    w = vec4(ease[k].xy, ease[j].xy)
    impulse = strike(u, n, r, arm, w, ease[k].z, friction)
    push(k, p, impulse)
    push(j, p, -impulse)
    pose[k].xy -= 0.02 * s.x * w.x / (w.x + w.z) * n  # in 50 substeps
    pose[j].xy += 0.02 * s.x * w.z / (w.x + w.z) * n


@ti.kernel
def move_rigid():
    """Move rigid bodies by gravity, by what hit them, and by contacts of their rims."""
    ti.loop_config(serialize=True)
    for k in range(N_OBJECTS):
        if ease[k].x > 0.0:
            twist[k].xy += ease[k].x * kick[k].xy + DT * vec2(GRAVITY)
            twist[k].z += ease[k].y * kick[k].z
            kick[k] = vec3(0.0)
    ti.loop_config(serialize=True)
    for i in range(rim.shape[0]):
        k = int(rim[i].x)
        p = pose[k].xy + cmul(pose[k].zw, rim[i].yz)
        for axis in ti.static(range(2)):
            edge = ti.min(p[axis], 1.0 - p[axis]) - EDGE
            if edge < 0.0:
                n = ti.select(p[axis] < 0.5, 1.0, -1.0) * vec2(1 - axis, axis)
                meet(k, WORLD, p, vec3(edge, n), WALLS["friction"])
        for n in range(N_COLLIDERS):
            j = collider[n]
            if j != k:
                s = surface(j, p)
                if s.x < 0.0:
                    meet(k, j, p, s, contact[n].y)
    ti.loop_config(serialize=True)
    for k in range(N_OBJECTS):
        if ease[k].x > 0.0:
            angle = DT * twist[k].z
            turn = cmul(pose[k].zw, vec2(ti.cos(angle), ti.sin(angle)))
            pose[k] = vec4(pose[k].xy + DT * twist[k].xy, turn.normalized())


@ti.func
def stress(p, m: ti.template()):
    """Strain particle p of material m for a step; Kirchhoff stress [Pa]."""
    t, z = 0.0, vec2(0.0)
    q[p], t = compress(q[p], c[p], DT, m["bulk_modulus"])
    t, z = newtonian(t, z, m["viscosity"], c[p], d[p])
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
    for k in ti.static(MOVING):
        move(k, OBJECTS[k]["kinematics"], clock[None] * DT)
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(N_GRID, N_GRID):
        m, node = grid[i, j].z, DX * vec2(i, j)
        if m > 0.0:
            g = grid[i, j].xy / m + DT * vec2(GRAVITY)
            room[i, j] = 1.0
            for n in range(N_STILL, N_COLLIDERS):
                k = collider[n]
                s = surface(k, node)
                room[i, j] = ti.min(room[i, j], s.x)
                if s.x < contact[n].z:
                    grid[i, j].w = DX**2  # solids fill space, too
                    before = g
                    u = velocity(k, node, s.yz)
                    g = touch(g, u, s.yz, contact[n].x, contact[n].y)
                    lost = m * (before - g)
                    kick[k] += vec3(lost, cross(node - pose[k].xy, lost))
            for axis in ti.static(range(2)):
                edge = ti.select(node[axis] < 0.5, node[axis], 1.0 - node[axis])
                if edge < EDGE + 0.3 * DX:  # a skin, so that the node on the wall acts
                    grid[i, j].w = DX**2
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
        crowd = N_GRID**2 * u.w  # part of space that matter at rest would fill
        for k in ti.static(LIQUIDS):
            if owner[p] == k:
                q[p] = settle(q[p], crowd, DT)
        moved = x[p] + DT * u.xy
        first, last = N_STILL, N_STILL  # of the colliders that are near
        if room[base + 1] < 2.0 * DX:
            last = N_COLLIDERS
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
    ti.loop_config(serialize=SERIAL)
    for n in range(N_STILL, N_COLLIDERS):
        k = collider[n]
        low = ti.max(ti.floor((pose[k].xy - measure[k].w) * PIXELS, ti.i32), 0)
        high = ti.min(ti.ceil((pose[k].xy + measure[k].w) * PIXELS, ti.i32), PIXELS)
        for i in range(low.x, high.x):
            for j in range(low.y, high.y):
                if surface(k, (vec2(i, j) + 0.5) / PIXELS).x < 0.0:
                    image[PIXELS - 1 - j, i] = ti.cast(k + 1, ti.u8)


def simulate():
    """The substeps of a frame, as a graph that runs without Python in between."""
    stages = [particles_to_grid, update_grid]
    stages.append(move_rigid)
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
    launch(*LAUNCH)
    image, frame = np.zeros((PIXELS, PIXELS), np.uint8), simulate()
    for n in range(SIMULATION["duration_frames"]):
        if n:
            frame.run({})
        draw(image)
        yield COLORS[image]


if __name__ == "__main__":
    codec, size = cv2.VideoWriter_fourcc(*"mp4v"), (PIXELS, PIXELS)
    video = cv2.VideoWriter(sys.argv[1], codec, OUTPUT["framerate"], size)
    for frame in frames():
        video.write(frame[:, :, ::-1])
    video.release()
