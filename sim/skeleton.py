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
from taichi.math import cconj, cmul, ivec3, vec2, vec3, vec4

from mpmworlds.sim.physics.contact import touch
from mpmworlds.sim.physics.deformation import advance, newtonian
from mpmworlds.sim.physics.elastic import fixed_corotated, lame
from mpmworlds.sim.physics.emission import jet
from mpmworlds.sim.physics.hencky import settle_strain
from mpmworlds.sim.physics.liquid import compress, settle
from mpmworlds.sim.physics.mesh import corotated_force, triangle_strain
from mpmworlds.sim.physics.motion import rotate
from mpmworlds.sim.physics.rigid import cross, strike
from mpmworlds.sim.physics.sand import cohesion, hencky_sand, soak
from mpmworlds.sim.physics.shapes import sd_box, sd_fan, sd_polygon
from mpmworlds.sim.physics.splines import bspline
from mpmworlds.sim.physics.viscoelastic import hencky_maxwell

# region scene
SIMULATION = dict(
    grid_resolution=64,
    time_step_dt=0.0001,
    substeps_per_frame=100,
    duration_frames=60,
    particles_per_cell=4,
    seed=7,
)
ENVIRONMENT = dict(
    gravity=[0.0, -9.8], walls=dict(contact="separate", friction=0.0, thickness_cells=3)
)
OBJECTS = [
    dict(
        name="object_0",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.25, 0.85], angle_deg=20.0, size=[0.12, 0.1]),
        physics_properties=dict(
            constitutive_model="elastic",
            density=1000.0,
            youngs_modulus=400000.0,
            poissons_ratio=0.3,
            damping=0.0,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F52D2C"),
    ),
    dict(
        name="object_1",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.5, 0.85], angle_deg=0.0, size=[0.12, 0.1]),
        physics_properties=dict(
            constitutive_model="elastic_fem",
            density=1000.0,
            youngs_modulus=200000.0,
            poissons_ratio=0.3,
            damping=0.0,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F52D2C"),
    ),
    dict(
        name="object_2",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.2, 0.12], angle_deg=0.0, size=[0.2, 0.12]),
        physics_properties=dict(
            constitutive_model="wet_sand",
            density=1600.0,
            youngs_modulus=800000.0,
            poissons_ratio=0.25,
            friction_angle_deg=35.0,
            cohesion=2000.0,
            saturation=0.3,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F5F42C"),
    ),
    dict(
        name="object_3",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.8, 0.8], angle_deg=0.0, size=[0.1, 0.1]),
        physics_properties=dict(
            constitutive_model="viscoelastic",
            density=1000.0,
            youngs_modulus=400000.0,
            poissons_ratio=0.3,
            relaxation_time=0.1,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#F52CF4"),
    ),
    dict(
        name="object_4",
        object_type="dynamic_body",
        shape=dict(type="box", center=[0.4, 0.5], angle_deg=0.0, size=[0.1, 0.06]),
        physics_properties=dict(
            constitutive_model="rigid",
            density=800.0,
            restitution=0.2,
            friction=0.3,
            skin_cells=0.3,
        ),
        initial_state=dict(velocity=[0.0, 0.0], angular_velocity=0.0),
        visualization=dict(color="#969696"),
    ),
    dict(
        name="object_5",
        object_type="static_collider",
        shape=dict(
            type="polygon",
            center=[0.4, 0.3],
            angle_deg=0.0,
            vertices=[[-0.1, -0.06], [0.1, -0.06], [0.0, 0.08]],
        ),
        contact=dict(type="separate", friction=0.2, skin_cells=0.3),
        visualization=dict(color="#969696"),
    ),
    dict(
        name="object_6",
        object_type="kinematic_collider",
        shape=dict(
            type="fan_blades",
            center=[0.75, 0.3],
            angle_deg=0.0,
            blade_count=4,
            blade_length=0.15,
            thickness=0.03,
        ),
        kinematics=dict(type="rotate", angular_velocity=6.0, start=0.0, stop=100.0),
        contact=dict(type="separate", friction=0.0, skin_cells=0.3),
        visualization=dict(color="#969696"),
    ),
    dict(
        name="object_7",
        object_type="emitter",
        shape=dict(type="box", center=[0.1, 0.6], angle_deg=0.0, size=[0.05, 0.06]),
        physics_properties=dict(
            constitutive_model="liquid",
            density=1000.0,
            bulk_modulus=400000.0,
            viscosity=0.1,
        ),
        emission=dict(type="jet", rate=900.0, velocity=[1.0, 0.0], start=0.0, stop=0.5),
        visualization=dict(color="#2C2DF5"),
    ),
]
OUTPUT = dict(resolution=256, framerate=30)
# endregion

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
# region if body
BODIES = [k for k in GRAINS if OBJECTS[k]["object_type"] == "dynamic_body"]
# endregion
# region if emitter
EMITTERS = [k for k in GRAINS if OBJECTS[k]["object_type"] == "emitter"]
# endregion
# region if collider
COLLIDERS = [k for k in range(N_OBJECTS) if k not in GRAINS]
MOTION = [
    o.get("kinematics", {"type": MODEL[k]})["type"] for k, o in enumerate(OBJECTS)
]
STILL = [k for k in COLLIDERS if MOTION[k] in (None, "conveyor")]  # never change place
COLLIDERS, N_STILL = STILL + [k for k in COLLIDERS if k not in STILL], len(STILL)
# endregion
# region if liquid
LIQUIDS = [k for k in GRAINS if MODEL[k] == "liquid"]
# endregion
# region if paste
PASTES = [k for k in GRAINS if MODEL[k] in ("viscoplastic", "viscoelastic")]
# endregion
# region if soak
SPONGES = [k for k in GRAINS if MODEL[k] == "wet_sand"]
# endregion


# region physics
# endregion


# region if solid
pose = ti.Vector.field(4, ti.f32, N_OBJECTS + 1)  # center x, y [m]; cos, sin of angle
kind = ti.field(ti.i32, N_OBJECTS)  # of shape, index in KINDS
measure = ti.Vector.field(4, ti.f32, N_OBJECTS)  # of the shape; radius around it [m]
# region if polygon
corners = ti.Vector.field(2, ti.f32, (N_OBJECTS, 24))  # of polygons [m]
# endregion
# endregion
# region if collider
N_COLLIDERS = len(COLLIDERS)
collider = ti.field(ti.i32, N_COLLIDERS)  # index of the object
contact = ti.Vector.field(3, ti.f32, N_COLLIDERS)  # law; friction; skin [m]
twist = ti.Vector.field(4, ti.f32, N_OBJECTS + 1)  # velocity [m/s]; spin; belt [m/s]
# region if free
room = ti.field(ti.f32, (N_GRID, N_GRID))  # distance to what moves [m]
# endregion
# endregion


# region if solid
# region shapes
KINDS = dict(box=0, fan_blades=1, polygon=2)


def measures(shape):
    """Numbers of a shape for its distance, and the radius around it [m]."""
    if shape["type"] == "box":
        reach = np.hypot(*shape["size"]) / 2
        return [*shape["size"], 0, reach]
    if shape["type"] == "fan_blades":
        reach = shape["blade_length"] + shape["thickness"] / 2
        return [shape["blade_count"], shape["blade_length"], shape["thickness"], reach]
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
        s = sd_fan(p, m.x, m.y, m.z)
    elif kind[k] == 2:
        s = sd_polygon(p, corners, k, int(m.x))
    return s


# endregion


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
        # region if polygon
        for i in range(vertices.shape[1]):
            corners[k, i] = vec2(vertices[k, i, 0], vertices[k, i, 1])
        # endregion
    # region if collider
    for n in range(N_COLLIDERS):
        k = int(touching[n, 0])
        collider[n], twist[k] = k, vec4(0.0)
        contact[n] = vec3(touching[n, 1], touching[n, 2], touching[n, 3])
    # endregion


SIZES, SORTS = [*map(measures, SHAPES)], [KINDS[shape["type"]] for shape in SHAPES]
VERTICES, TOUCHING = np.zeros((N_OBJECTS, 24, 2)), np.zeros((1, 4))
# region if polygon
for k in range(N_OBJECTS):
    rows = SHAPES[k].get("vertices", [])
    VERTICES[k, : len(rows)] = np.reshape(rows, (-1, 2))
# endregion
# region if collider
TOUCH = [OBJECTS[k].get("contact", {"type": "separate"} | MATTER[k]) for k in COLLIDERS]
TOUCHING = [[LAWS[c["type"]], c["friction"], DX * c["skin_cells"]] for c in TOUCH]
TOUCHING = np.column_stack([COLLIDERS, TOUCHING])
# endregion
TABLES = [np.int32(SORTS), *map(np.float32, (HOME, SIZES, VERTICES, TOUCHING))]
set_up(*TABLES)


# endregion
# region if probe
@ti.kernel
def probe(k: int, points: ARRAY, found: ARRAY):
    """Signed distance [m] of points from object k, and its normals."""
    ti.loop_config(serialize=SERIAL)
    for p in range(points.shape[0]):
        s = surface(k, vec2(points[p, 0], points[p, 1]))
        found[p, 0], found[p, 1], found[p, 2] = s.x, s.y, s.z


# endregion
# region if still
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


# endregion
# region if lattice
def lattice(k, shake):
    """Points [m] of a lattice shaken by parts of it, their distances and normals."""
    rng = np.random.Generator(np.random.Philox(SIMULATION["seed"]))
    cells = np.argwhere(np.ones((round(1 / SPACING), round(1 / SPACING))))
    points = SPACING * (cells + 0.5 + shake * (rng.random(cells.shape) - 0.5))
    found = np.empty((len(points), 3), np.float32)
    probe(k, points.astype(np.float32), found)
    return points, found[:, 0], found[:, 1:]


# endregion
none, nowhere = np.zeros(0), np.zeros((0, 2))
GROUPS = [(none, none, nowhere, nowhere, none)]  # object, birth, place, velocity, spin
# region if body
for k in BODIES:
    points, depth, _ = lattice(k, 0.0 if MODEL[k] == "elastic_fem" else 0.5)
    place, state = points[depth < 0.0], OBJECTS[k]["initial_state"]
    spin, none = state["angular_velocity"], np.zeros(len(place))
    arm = (place - HOME[k][:2])[:, ::-1] * [-1, 1]  # turned by 90 degrees
    GROUPS.append((k + none, none, place, state["velocity"] + spin * arm, spin + none))
# endregion
# region if emitter
# region emission
EMIT = dict(jet=jet)
# endregion
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
# endregion
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
# region if wet
saturation = ti.field(ti.f32, N_PARTICLES)  # part of the pores that water fills
WETNESS = np.float32([m.get("saturation", 0.0) for m in MATTER])[OWNER]
# endregion
# region if soak
water = ti.field(ti.f32, (N_GRID, N_GRID))  # volume of liquid at rest
# endregion


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


# region if collider
@ti.func
def velocity(k, p, n):
    """Velocity [m/s] of the surface of collider k at p, where its normal is n."""
    arm, belt = p - pose[k].xy, twist[k].w * vec2(n.y, -n.x)
    return twist[k].xy + cmul(vec2(0.0, twist[k].z), arm) + belt


# endregion
# region if moving
MOVING = [k for k in COLLIDERS if OBJECTS[k]["object_type"] == "kinematic_collider"]


# region motion
@ti.func
def move(k: ti.template(), motion: ti.template(), t):
    """Put collider k where its motion has it at time t [s]."""
    moved, rate = rotate(t, motion)
    now, twist[k] = vec3(HOME[k]) + moved, rate
    pose[k] = vec4(now.xy, ti.cos(now.z), ti.sin(now.z))


# endregion
# endregion
# region if rigid
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


# endregion
# region if mesh
MESHES = [k for k in GRAINS if MODEL[k] == "elastic_fem"]


def triangulate(k):
    """Triangles between the particles of body k, each three indices, anticlockwise."""
    mine = np.flatnonzero(np.equal(OWNER, k))
    number = np.full((N_GRID * 4, N_GRID * 4), -1)
    number[tuple(np.rint(START[mine, :2].T / SPACING - 0.5).astype(int))] = mine
    square = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    square = np.stack(square).reshape(4, -1)
    square = square[:, (square >= 0).sum(axis=0) >= 3]
    last = np.where(square.min(axis=0) < 0, square.argmin(axis=0), square[0] % 2)
    square = np.take_along_axis(square, (np.arange(4)[:, None] + last + 1) % 4, 0)
    return np.concatenate([square[:3], square[[2, 3, 0]][:, square[3] >= 0]], axis=1).T


TRIANGLES = np.concatenate([triangulate(k) for k in MESHES]).astype(np.int32)
triangle = ti.Vector.field(3, ti.i32, len(TRIANGLES))
edges = ti.Vector.field(4, ti.f32, len(TRIANGLES))  # two from the first corner, at rest


@ti.kernel
def weave(triangles: ARRAY):
    """Enter the triangles and their edges at rest."""
    for n in range(triangles.shape[0]):
        i, j, k = triangles[n, 0], triangles[n, 1], triangles[n, 2]
        triangle[n], edges[n] = ivec3(i, j, k), vec4(x[j] - x[i], x[k] - x[i])


@ti.kernel
def pull():
    """Accelerate the corners of triangles by their elastic forces."""
    ti.loop_config(serialize=SERIAL)
    for n in range(triangle.shape[0]):
        i, j, l = triangle[n]
        for k in ti.static(MESHES):
            if owner[i] == k:
                one, two = edges[n].xy, edges[n].zw
                mu, lam = lame(MATTER[k]["youngs_modulus"], MATTER[k]["poissons_ratio"])
                A, B = triangle_strain(x[j] - x[i], x[l] - x[i], one, two, 0.5 * AREA)
                gain = DT / (AREA * MATTER[k]["density"])
                at_j = gain * corotated_force(A, B, -two, mu, lam)
                at_l = gain * corotated_force(A, B, one, mu, lam)
                v[j] += at_j
                v[l] += at_l
                v[i] -= at_j + at_l


# endregion
# region materials
@ti.func
def stress(p, m: ti.template()):
    """Strain particle p of material m for a step; Kirchhoff stress [Pa]."""
    t, z = 0.0, vec2(0.0)
    if ti.static(m["constitutive_model"] == "elastic"):
        mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
        a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
        t, z = fixed_corotated(a[p], b[p], mu, lam)
        t, z = newtonian(t, z, m["damping"], c[p], d[p])
    elif ti.static(m["constitutive_model"] == "elastic_fem"):
        t, z = newtonian(t, z, m["damping"], c[p], d[p])
    elif ti.static(m["constitutive_model"] == "liquid"):
        q[p], t = compress(q[p], c[p], DT, m["bulk_modulus"])
        t, z = newtonian(t, z, m["viscosity"], c[p], d[p])
    elif ti.static(m["constitutive_model"] == "viscoelastic"):
        mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
        a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
        time = m["relaxation_time"]
        a[p], b[p], q[p], t, z = hencky_maxwell(a[p], b[p], q[p], DT, mu, lam, time)
    elif ti.static(m["constitutive_model"] == "wet_sand"):
        mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
        phi = ti.math.radians(m["friction_angle_deg"])
        bond = cohesion(saturation[p], m["cohesion"])
        a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
        a[p], b[p], q[p], t, z = hencky_sand(a[p], b[p], q[p], mu, lam, phi, bond)
    return t, z


# endregion


@ti.kernel
def particles_to_grid():
    """Scatter mass, momentum and the impulse of stress."""
    count_living()
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(N_GRID, N_GRID):
        grid[i, j] = vec4(0.0)
        # region if soak
        water[i, j] = 0.0
        # endregion
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
        # region if soak
        for k in ti.static(LIQUIDS):
            if owner[p] == k:
                for i, j in ti.static(ti.ndrange(3, 3)):
                    water[base.x + i, base.y + j] += w[i].x * w[j].y * AREA
        # endregion


@ti.kernel
def update_grid():
    """Turn momentum into velocity a step later, with gravity and contact."""
    clock[None] += 1
    # region if moving
    for k in ti.static(MOVING):
        move(k, OBJECTS[k]["kinematics"], clock[None] * DT)
    # endregion
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(N_GRID, N_GRID):
        m, node = grid[i, j].z, DX * vec2(i, j)
        if m > 0.0:
            g = grid[i, j].xy / m + DT * vec2(GRAVITY)
            # region if still
            s, near = still[i, j].xyz, int(still[i, j].w)
            if s.x < contact[near].z:
                # region if crowd
                grid[i, j].w = DX**2  # solids fill space, too
                # endregion
                u = velocity(collider[near], node, s.yz)
                g = touch(g, u, s.yz, contact[near].x, contact[near].y)
            # endregion
            # region if free
            room[i, j] = 1.0
            for n in range(N_STILL, N_COLLIDERS):
                k = collider[n]
                s = surface(k, node)
                room[i, j] = ti.min(room[i, j], s.x)
                if s.x < contact[n].z:
                    # region if crowd
                    grid[i, j].w = DX**2  # solids fill space, too
                    # endregion
                    # region if rigid
                    before = g
                    # endregion
                    u = velocity(k, node, s.yz)
                    g = touch(g, u, s.yz, contact[n].x, contact[n].y)
                    # region if rigid
                    lost = m * (before - g)
                    kick[k] += vec3(lost, cross(node - pose[k].xy, lost))
                    # endregion
            # endregion
            for axis in ti.static(range(2)):
                edge = ti.select(node[axis] < 0.5, node[axis], 1.0 - node[axis])
                if edge < EDGE + 0.3 * DX:  # a skin, so that the node on the wall acts
                    # region if crowd
                    grid[i, j].w = DX**2
                    # endregion
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
        # region if crowd
        crowd = N_GRID**2 * u.w  # part of space that matter at rest would fill
        # endregion
        # region if liquid
        for k in ti.static(LIQUIDS):
            if owner[p] == k:
                q[p] = settle(q[p], crowd, DT)
        # endregion
        # region if paste
        for k in ti.static(PASTES):
            if owner[p] == k:
                a[p], b[p] = settle_strain(a[p], b[p], crowd, DT)
        # endregion
        # region if soak
        for k in ti.static(SPONGES):
            if owner[p] == k:
                wet = 0.0  # volume of water over that of the cell
                for i, j in ti.static(ti.ndrange(3, 3)):
                    wet += N_GRID**2 * w[i].x * w[j].y * water[base.x + i, base.y + j]
                saturation[p] = soak(saturation[p], wet, DT)
        # endregion
        moved = x[p] + DT * u.xy
        # region if collider
        first, last = N_STILL, N_STILL  # of the colliders that are near
        # region if still
        if still[base + 1].x < 2.0 * DX:
            first = 0
        # endregion
        # region if free
        if room[base + 1] < 2.0 * DX:
            last = N_COLLIDERS
        # endregion
        for n in range(first, last):  # thin and fast ones overtake particles
            s = surface(collider[n], moved)
            moved -= ti.min(s.x, 0.0) * s.yz
        # endregion
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
    # region if free
    ti.loop_config(serialize=SERIAL)
    for n in range(N_STILL, N_COLLIDERS):
        k = collider[n]
        low = ti.max(ti.floor((pose[k].xy - measure[k].w) * PIXELS, ti.i32), 0)
        high = ti.min(ti.ceil((pose[k].xy + measure[k].w) * PIXELS, ti.i32), PIXELS)
        for i in range(low.x, high.x):
            for j in range(low.y, high.y):
                if surface(k, (vec2(i, j) + 0.5) / PIXELS).x < 0.0:
                    image[PIXELS - 1 - j, i] = ti.cast(k + 1, ti.u8)
    # endregion


def simulate():
    """The substeps of a frame, as a graph that runs without Python in between."""
    stages = [particles_to_grid, update_grid]
    # region if mesh
    stages.insert(0, pull)
    # endregion
    # region if rigid
    stages.append(move_rigid)
    # endregion
    builder = ti.graph.GraphBuilder()
    substep = builder.create_sequential()
    for stage in [*stages, grid_to_particles]:
        substep.dispatch(stage)
    for _ in range(SIMULATION["substeps_per_frame"]):
        builder.append(substep)
    return builder.compile()


def frames():
    """Yield the frames of the video, each uint8 RGB of shape (PIXELS, PIXELS, 3)."""
    # region if solid
    set_up(*TABLES)
    # endregion
    give_birth(START, BIRTH, OWNER)
    # region if wet
    saturation.from_numpy(WETNESS)
    # endregion
    # region if mesh
    weave(TRIANGLES)
    # endregion
    # region if rigid
    launch(*LAUNCH)
    # endregion
    image, frame = np.zeros((PIXELS, PIXELS), np.uint8), simulate()
    for n in range(SIMULATION["duration_frames"]):
        if n:
            frame.run({})
        draw(image)
        # region if still
        image[BACKDROP > 0] = BACKDROP[BACKDROP > 0]
        # endregion
        yield COLORS[image]


if __name__ == "__main__":
    codec, size = cv2.VideoWriter_fourcc(*"mp4v"), (PIXELS, PIXELS)
    video = cv2.VideoWriter(sys.argv[1], codec, OUTPUT["framerate"], size)
    for frame in frames():
        video.write(frame[:, :, ::-1])
    video.release()
