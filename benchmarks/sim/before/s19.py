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
    seed=20,
)
ENVIRONMENT = dict(
    gravity=[0.0, -9.8], walls=dict(contact="separate", friction=0.1, thickness_cells=6)
)
OBJECTS = [
    dict(
        name="object_0",
        object_type="dynamic_body",
        shape=dict(
            type="box", center=[0.161875, 0.151875], angle_deg=0.0, size=[0.23, 0.21]
        ),
        physics_properties=dict(
            constitutive_model="liquid",
            density=1000.0,
            bulk_modulus=500000.0,
            viscosity=0.05,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#2C90F5"),
    ),
    dict(
        name="object_1",
        object_type="dynamic_body",
        shape=dict(
            type="box", center=[0.838125, 0.136875], angle_deg=0.0, size=[0.23, 0.18]
        ),
        physics_properties=dict(
            constitutive_model="sand",
            density=1600.0,
            youngs_modulus=700000.0,
            poissons_ratio=0.25,
            friction_angle_deg=34.0,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F5C22D"),
    ),
    dict(
        name="object_2",
        object_type="dynamic_body",
        shape=dict(type="circle", center=[0.24, 0.74], radius=0.09),
        physics_properties=dict(
            constitutive_model="snow",
            density=400.0,
            youngs_modulus=37000.0,
            poissons_ratio=0.2,
            yield_compression=0.025,
            yield_stretch=0.005,
            hardening_rate=10.0,
            hardening_min=0.1,
            hardening_max=5.0,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#FFFFFF"),
    ),
    dict(
        name="object_3",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.48, 0.82], angle_deg=25.0, size=[0.14, 0.14]),
        physics_properties=dict(
            constitutive_model="elastic",
            density=1000.0,
            youngs_modulus=350000.0,
            poissons_ratio=0.3,
            damping=0.0,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#5EF52C"),
    ),
    dict(
        name="object_4",
        object_type="dynamic_body",
        shape=dict(type="circle", center=[0.75, 0.7], radius=0.1),
        physics_properties=dict(
            constitutive_model="viscoplastic",
            density=1200.0,
            youngs_modulus=300000.0,
            poissons_ratio=0.4,
            yield_stress=60.0,
            consistency=60.0,
            exponent=1.0,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F52C90"),
    ),
    dict(
        name="object_5",
        object_type="kinematic_collider",
        shape=dict(
            type="fan_blades",
            center=[0.5, 0.29],
            angle_deg=0.0,
            blade_count=3,
            blade_length=0.21,
            thickness=0.035,
        ),
        kinematics=dict(type="rotate", angular_velocity=4.0, start=0.0, stop=100.0),
        contact=dict(type="separate", friction=0.2, skin_cells=0.3),
        visualization=dict(color="#969696"),
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
LIQUIDS = [k for k in GRAINS if MODEL[k] == "liquid"]
PASTES = [k for k in GRAINS if MODEL[k] in ("viscoplastic", "viscoelastic")]


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
def fixed_corotated(a, b, mu, lam):
    """tau = 2 mu (F - R) F^T + lam J (J - 1) I [Stomakhin et al. 2012]."""
    A = ti.max(a.norm(), 1e-6)
    B2 = b.dot(b)
    J = A * A - B2
    t = 2.0 * mu * (A * A + B2 - A) + lam * J * (J - 1.0)
    return t, 2.0 * mu * (2.0 - 1.0 / A) * cmul(a, b)


@ti.func
def hardening(Jp, rate, lowest, highest):
    """Factor exp(rate (1 - Jp)) on the moduli, clamped to [lowest, highest]."""
    return ti.min(ti.max(ti.exp(rate * (1.0 - Jp)), lowest), highest)


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
def overstress(excess, drag, eta, n):
    """Solve x + drag (x / eta)^(1/n) = excess > 0 for x [Pa]; drag = mu dt [Pa s].

    Closed for n = 1; else Newton's method in u = log(x / eta), where the equation is
    nearly linear, from the nearer of its limits for small and large drag. Two steps
    leave an error below 0.2 % for n of 0.2 to 2.
    """
    x = excess * eta / (eta + drag)
    if n != 1.0:
        u = ti.min(ti.log(excess / eta), n * ti.log(excess / drag))
        for _ in range(2):
            rest, flow = eta * ti.exp(u), drag * ti.exp(u / n)
            u -= ti.log((rest + flow) / excess) * (rest + flow) / (rest + flow / n)
        x = eta * ti.exp(u)
    return x


@ti.func
def hencky_paste(a, b, q, dt, mu, lam, k, eta, n):
    """Let F flow for a step: new F and q, Kirchhoff stress t, z.

    Herschel-Bulkley: shear stress |z| = k + eta (shear rate)^n, eta [Pa s^n], of which
    n = 1 is Bingham's; elastic below k. Volume is elastic, but matter parts beyond a
    gain of a tenth.
    """
    m, g = hencky(a, b)
    m, new_q = loosen(m, q, 0.05)
    excess = 2.0 * mu * g - k
    if excess > 0.0:
        g = 0.5 / mu * (k + overstress(excess, mu * dt, eta, n))
    new_a, new_b = restretch(a, b, ti.exp(m + g), ti.exp(m - g))
    t, z = hencky_stress(a, b, m, g, mu, lam)
    return new_a, new_b, new_q, t, z


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
def newtonian(t, z, eta, c, d):
    """Add the viscous stress eta (C + C^T), eta [Pa s], to the stress t I + D(z)."""
    return t + 2.0 * eta * c.x, z + 2.0 * eta * d


@ti.func
def pack(a, b, Jp, compression, stretch):
    """Keep singular values of F in [1 - compression, 1 + stretch]; Jp takes the rest.

    Jp is the plastic volume ratio, bounded so that hardening stays reversible.
    """
    A, B = a.norm(), b.norm()
    s1 = ti.min(ti.max(A + B, 1.0 - compression), 1.0 + stretch)
    s2 = ti.min(ti.max(A - B, 1.0 - compression), 1.0 + stretch)
    new_a, new_b, new_Jp = a, b, Jp
    if s1 != A + B or s2 != A - B:
        new_a, new_b = restretch(a, b, s1, s2)
        new_Jp = ti.min(ti.max(Jp * (A * A - B * B) / (s1 * s2), 0.6), 20.0)
    return new_a, new_b, new_Jp


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
def sd_circle(p, radius):
    """Disc of the given radius [m] around the origin."""
    r = p.norm()
    return vec3(r - radius, p / ti.max(r, 1e-9))


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
def settle_strain(a, b, crowd, dt):
    """Relax the volume of F = (a, b) within 5 ms where the filled space says so.

    As `settle`, for fluids that bear tension: where `crowd`, the part of space that
    matter and solids here would fill at rest, is below 0.9, pressure fades and holes
    close; above 1.1 it builds up.
    """
    J = a.dot(a) - b.dot(b)
    aim = J
    if crowd < 0.9:
        aim = ti.max(J, 1.0)
    elif crowd > 1.1:
        aim = ti.min(J, ti.max(1.0 / crowd, 0.8))
    s = 1.0 + 0.5 * dt / 0.005 * (aim / J - 1.0)
    return s * a, s * b


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

KINDS = dict(box=0, circle=1, fan_blades=2)


def measures(shape):
    """Numbers of a shape for its distance, and the radius around it [m]."""
    if shape["type"] == "box":
        reach = np.hypot(*shape["size"]) / 2
        return [*shape["size"], 0, reach]
    if shape["type"] == "circle":
        reach = shape["radius"]
        return [shape["radius"], 0, 0, reach]
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
        s = sd_circle(p, m.x)
    elif kind[k] == 2:
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


MOVING = [k for k in COLLIDERS if OBJECTS[k]["object_type"] == "kinematic_collider"]


@ti.func
def move(k: ti.template(), motion: ti.template(), t):
    """Put collider k where its motion has it at time t [s]."""
    moved, rate = rotate(t, motion)
    now, twist[k] = vec3(HOME[k]) + moved, rate
    pose[k] = vec4(now.xy, ti.cos(now.z), ti.sin(now.z))


@ti.func
def stress(p, m: ti.template()):
    """Strain particle p of material m for a step; Kirchhoff stress [Pa]."""
    t, z = 0.0, vec2(0.0)
    if ti.static(m["constitutive_model"] == "elastic"):
        mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
        a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
        t, z = fixed_corotated(a[p], b[p], mu, lam)
        t, z = newtonian(t, z, m["damping"], c[p], d[p])
    elif ti.static(m["constitutive_model"] == "liquid"):
        q[p], t = compress(q[p], c[p], DT, m["bulk_modulus"])
        t, z = newtonian(t, z, m["viscosity"], c[p], d[p])
    elif ti.static(m["constitutive_model"] == "sand"):
        mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
        phi = ti.math.radians(m["friction_angle_deg"])
        a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
        a[p], b[p], q[p], t, z = hencky_sand(a[p], b[p], q[p], mu, lam, phi, 0.0)
    elif ti.static(m["constitutive_model"] == "snow"):
        mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
        a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
        compression, stretch = m["yield_compression"], m["yield_stretch"]
        a[p], b[p], q[p] = pack(a[p], b[p], q[p], compression, stretch)
        lowest, highest = m["hardening_min"], m["hardening_max"]
        h = hardening(q[p], m["hardening_rate"], lowest, highest)
        t, z = fixed_corotated(a[p], b[p], h * mu, h * lam)
    elif ti.static(m["constitutive_model"] == "viscoplastic"):
        mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
        k, eta, n = m["yield_stress"], m["consistency"], m["exponent"]
        a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
        a[p], b[p], q[p], t, z = hencky_paste(a[p], b[p], q[p], DT, mu, lam, k, eta, n)
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
                    u = velocity(k, node, s.yz)
                    g = touch(g, u, s.yz, contact[n].x, contact[n].y)
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
        for k in ti.static(PASTES):
            if owner[p] == k:
                a[p], b[p] = settle_strain(a[p], b[p], crowd, DT)
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
        yield COLORS[image]


if __name__ == "__main__":
    codec, size = cv2.VideoWriter_fourcc(*"mp4v"), (PIXELS, PIXELS)
    video = cv2.VideoWriter(sys.argv[1], codec, OUTPUT["framerate"], size)
    for frame in frames():
        video.write(frame[:, :, ::-1])
    video.release()
