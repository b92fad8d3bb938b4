"""One scene of the 2D Material Point Method, complete in this file.

MLS-MPM [Hu et al. 2018] with APIC transfers [Jiang et al. 2015] and quadratic B-splines.
`python program.py out.mp4` writes a preview; `frames()` yields the exact frames.

Vectors are complex numbers and a 2 x 2 matrix is a pair of them: M z = a z + b conj(z).
Then |a| + |b| and |a| - |b| are its singular values, a / |a| is its polar rotation. The
strain F is (a, b), the velocity gradient C is (c, d), a symmetric stress is (t, z).
"""

import sys

import cv2
import numpy as np
import taichi as ti
from taichi.math import cconj, cmul, ivec2, vec2, vec3, vec4

from mpmworlds.sim.physics.contact import touch
from mpmworlds.sim.physics.deformation import advance, newtonian
from mpmworlds.sim.physics.elastic import fixed_corotated, lame
from mpmworlds.sim.physics.liquid import compress, settle
from mpmworlds.sim.physics.motion import rotate
from mpmworlds.sim.physics.shapes import sd_box, sd_circle, sd_fan
from mpmworlds.sim.physics.splines import bspline

# region scene
SIMULATION = {
    "grid_resolution": 64,
    "time_step_dt": 0.0002,
    "substeps_per_frame": 50,
    "duration_frames": 60,
    "particles_per_cell": 4,
    "seed": 7,
}
ENVIRONMENT = {
    "gravity": [0.0, -9.8],
    "walls": {"contact": "separate", "friction": 0.0, "thickness_cells": 3},
}
OBJECTS = [
    {
        "name": "object_0",
        "object_type": "dynamic_body",
        "shape": {
            "type": "box",
            "center": [0.5, 0.75],
            "size": [0.3, 0.2],
            "angle_deg": 20.0,
        },
        "physics_properties": {
            "constitutive_model": "elastic",
            "density": 1000.0,
            "youngs_modulus": 800000.0,
            "poissons_ratio": 0.3,
            "damping": 0.0,
        },
        "initial_state": {"velocity": [0.0, 0.0], "angular_velocity": 0.0},
        "visualization": {"color": "#FF0000"},
    },
    {
        "name": "object_1",
        "object_type": "static_collider",
        "shape": {"type": "circle", "center": [0.3, 0.3], "radius": 0.08},
        "contact": {"type": "separate", "friction": 0.2, "skin_cells": 0.3},
        "visualization": {"color": "#808080"},
    },
    {
        "name": "object_2",
        "object_type": "kinematic_collider",
        "shape": {
            "type": "fan_blades",
            "center": [0.6, 0.3],
            "blade_count": 4,
            "blade_length": 0.15,
            "thickness": 0.02,
            "angle_deg": 0.0,
        },
        "kinematics": {"type": "rotate", "angular_velocity": 6.0},
        "contact": {"type": "separate", "friction": 0.1, "skin_cells": 0.3},
        "visualization": {"color": "#FFFF00"},
    },
    {
        "name": "object_3",
        "object_type": "emitter",
        "shape": {
            "type": "box",
            "center": [0.2, 0.9],
            "size": [0.05, 0.06],
            "angle_deg": 0.0,
        },
        "physics_properties": {
            "constitutive_model": "liquid",
            "density": 1000.0,
            "bulk_modulus": 1000000.0,
            "viscosity": 0.1,
        },
        "emission": {"rate": 1600.0, "velocity": [1.0, 0.0], "start": 0.0, "stop": 0.5},
        "visualization": {"color": "#0000FF"},
    },
]
OUTPUT = {"resolution": 256, "framerate": 30}
# endregion

DT = SIMULATION["time_step_dt"]
N_GRID = SIMULATION["grid_resolution"]
DX = 1.0 / N_GRID
SPACING = DX / SIMULATION["particles_per_cell"] ** 0.5  # of particles at rest
AREA = SPACING**2  # of a particle at rest: its volume per unit thickness
WALLS = ENVIRONMENT["walls"]
LAWS = {"sticky": 0, "slip": 1, "separate": 2}
PIXELS = OUTPUT["resolution"]
BLOB = 2.0 * SPACING  # radius of the metaball that a particle is drawn as
SOLID = 1.2  # sum of metaballs from which a pixel is covered

ti.init(arch=ti.cpu, cpu_max_num_threads=1, fast_math=False, log_level=ti.WARN)
SERIAL = ti.cfg.arch in (ti.x64, ti.arm64)  # on a GPU the same loops run in parallel


def of_type(object_type):
    """Indices of the objects of a type."""
    return [k for k, o in enumerate(OBJECTS) if o["object_type"] == object_type]


# region physics
# endregion


# region shapes
@ti.func
def distance(shape: ti.template(), p):
    """Signed distance [m] and normal of a shape at p, in its own frame."""
    s = vec3(0.0)
    if ti.static(shape["type"] == "box"):
        s = sd_box(p, shape["size"])
    elif ti.static(shape["type"] == "circle"):
        s = sd_circle(p, shape["radius"])
    elif ti.static(shape["type"] == "fan_blades"):
        s = sd_fan(p, shape["blade_count"], shape["blade_length"], shape["thickness"])
    return s


def reach(shape):
    """Radius [m] of the circle around its center that holds a shape."""
    if shape["type"] == "box":
        return np.hypot(*shape["size"]) / 2
    if shape["type"] == "circle":
        return shape["radius"]
    return shape["blade_length"] + shape["thickness"] / 2


# endregion
MATTER = [o.get("physics_properties", {}) for o in OBJECTS]
# region if liquid
LIQUIDS = [k for k, m in enumerate(MATTER) if m.get("constitutive_model") == "liquid"]
# endregion
SHAPES = [o["shape"] for o in OBJECTS]
REACH = [reach(shape) for shape in SHAPES]
HOME = [[*s["center"], np.radians(s.get("angle_deg", 0.0))] for s in SHAPES]
pose = ti.Vector.field(4, ti.f32, len(OBJECTS))  # center x, y [m]; cos, sin of angle
twist = ti.Vector.field(3, ti.f32, len(OBJECTS))  # velocity x, y [m/s]; spin [rad/s]
for k, (home_x, home_y, angle) in enumerate(HOME):
    pose[k] = [home_x, home_y, np.cos(angle), np.sin(angle)]


@ti.func
def surface(k: ti.template(), p):
    """Signed distance [m] from p to object k, at least from afar, and outward normal."""
    arm, turn = p - pose[k].xy, pose[k].zw
    s = vec3(arm.norm() - REACH[k], arm)
    if s.x < DX:
        s = distance(SHAPES[k], cmul(arm, cconj(turn)))
        s = vec3(s.x, cmul(turn, s.yz))
    return s


# region if collider
COLLIDERS = of_type("static_collider") + of_type("kinematic_collider")


@ti.func
def collide(k: ti.template(), contact: ti.template(), g, node):
    """Velocity g of a grid node [m] after contact with collider k."""
    s = surface(k, node)
    if s.x < DX * contact["skin_cells"]:
        rigid = twist[k].xy + cmul(vec2(0.0, twist[k].z), node - pose[k].xy)
        g = touch(g, rigid, s.yz, LAWS[contact["type"]], contact["friction"])
    return g


# endregion
# region motion
@ti.func
def move(k: ti.template(), motion: ti.template(), t):
    """Put collider k where its motion has it at time t [s]."""
    moved, rate = rotate(t, motion["angular_velocity"])
    now, twist[k] = vec3(HOME[k]) + moved, rate
    pose[k] = vec4(now.xy, ti.cos(now.z), ti.sin(now.z))


# endregion
# region if body
@ti.kernel
def find_owners(points: ti.types.ndarray(), owners: ti.types.ndarray()):
    """Index of the body around each point, where there is one."""
    ti.loop_config(serialize=SERIAL)
    for p in range(points.shape[0]):
        for k in ti.static(of_type("dynamic_body")):
            if surface(k, vec2(points[p, 0], points[p, 1])).x < 0.0:
                owners[p] = k


def fill_bodies():
    """Particles on a jittered lattice: object, birth step, position, velocity."""
    rng = np.random.Generator(np.random.Philox(SIMULATION["seed"]))
    cells = np.argwhere(np.ones((round(1 / SPACING), round(1 / SPACING))))
    points = SPACING * (cells + 0.25 + 0.5 * rng.random(cells.shape))
    owners = np.full(len(points), -1, np.int32)
    find_owners(points.astype(np.float32), owners)
    for k in of_type("dynamic_body"):
        inside, state = points[owners == k], OBJECTS[k]["initial_state"]
        arm = (inside - HOME[k][:2])[:, ::-1] * [-1, 1]  # turned by 90 degrees
        velocity = state["velocity"] + state["angular_velocity"] * arm
        yield np.full(len(inside), k), np.zeros(len(inside), int), inside, velocity


# endregion
# region if emitter
def fill_jets():
    """Particles on a Kronecker lattice of time of birth and place across the nozzle."""
    for k in of_type("emitter"):
        jet = OBJECTS[k]["emission"]
        n = np.arange(round(jet["rate"] * (jet["stop"] - jet["start"])))
        time = jet["start"] + (n + 0.5) / jet["rate"]
        birth, velocity = np.ceil(time / DT), np.array(jet["velocity"])
        across = velocity[::-1] * [-1, 1] / np.hypot(*velocity)
        sides = HOME[k][2] + np.array([0.0, np.pi / 2])
        extent = abs(np.cos(sides) * across[0] + np.sin(sides) * across[1])
        place = (n * (5**0.5 - 1) / 2 % 1 - 0.5) * (extent @ SHAPES[k]["size"])
        points = np.outer(place, across) + np.outer(birth * DT - time, velocity)
        yield np.full(len(n), k), birth, HOME[k][:2] + points, velocity + 0 * points


# endregion
GROUPS = []
# region if body
GROUPS += fill_bodies()
# endregion
# region if emitter
GROUPS += fill_jets()
# endregion
OWNER, BIRTH, PLACE, SPEED = map(np.concatenate, zip(*GROUPS))
ORDER = np.argsort(BIRTH, kind="stable")  # so that the living come first
BIRTH = BIRTH[ORDER]

x, v, c, d, a, b = (ti.Vector.field(2, ti.f32) for _ in range(6))
q, owner = ti.field(ti.f32), ti.field(ti.i32)  # state of the material; object
ti.root.dense(ti.i, len(ORDER)).place(x, v, c, d, a, b, q, owner)
grid = ti.Vector.field(3, ti.f32, (N_GRID, N_GRID))  # momentum or velocity; mass


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
    elif ti.static(m["constitutive_model"] == "liquid"):
        q[p], t = compress(q[p], c[p], DT, m["bulk_modulus"])
        t, z = newtonian(t, z, m["viscosity"], c[p], d[p])
    return t, z


# endregion


@ti.kernel
def particles_to_grid(alive: int):
    """Scatter mass, momentum and the impulse of stress."""
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(N_GRID, N_GRID):
        grid[i, j] = vec3(0.0)
    ti.loop_config(serialize=SERIAL)
    for p in range(alive):
        m, t, z = 0.0, 0.0, vec2(0.0)
        for k in ti.static(of_type("dynamic_body") + of_type("emitter")):
            if owner[p] == k:
                m = AREA * MATTER[k]["density"]
                t, z = stress(p, MATTER[k])
        impulse = -4.0 * DT * AREA / DX**2
        ma, mb = m * c[p] + vec2(impulse * t, 0.0), m * d[p] + impulse * z
        base = ti.floor(x[p] / DX - 0.5, ti.i32)
        f = x[p] / DX - base
        w = bspline(f)
        for i, j in ti.static(ti.ndrange(3, 3)):
            r = (vec2(i, j) - f) * DX
            momentum = m * v[p] + cmul(ma, r) + cmul(mb, cconj(r))
            grid[base + ivec2(i, j)] += w[i].x * w[j].y * vec3(momentum, m)


@ti.kernel
def update_grid(t: float):
    """Turn momentum into velocity at time t, with gravity and contact."""
    # region if moving
    for k in ti.static(of_type("kinematic_collider")):
        move(k, OBJECTS[k]["kinematics"], t)
    # endregion
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(N_GRID, N_GRID):
        if grid[i, j].z > 0.0:
            g = grid[i, j].xy / grid[i, j].z + DT * vec2(ENVIRONMENT["gravity"])
            # region if collider
            for k in ti.static(COLLIDERS):
                g = collide(k, OBJECTS[k]["contact"], g, DX * vec2(i, j))
            # endregion
            for axis in ti.static(range(2)):
                node, edge = ivec2(i, j)[axis], WALLS["thickness_cells"]
                if node < edge or node > N_GRID - edge:
                    n = ti.select(node < edge, 1.0, -1.0) * vec2(1 - axis, axis)
                    g = touch(
                        g, vec2(0.0), n, LAWS[WALLS["contact"]], WALLS["friction"]
                    )
            grid[i, j].xy = g


@ti.kernel
def grid_to_particles(alive: int):
    """Gather velocity and its gradient, and move."""
    ti.loop_config(serialize=SERIAL)
    for p in range(alive):
        base = ti.floor(x[p] / DX - 0.5, ti.i32)
        f = x[p] / DX - base
        w = bspline(f)
        u, turn, shear, heap = vec2(0.0), vec2(0.0), vec2(0.0), 0.0
        for i, j in ti.static(ti.ndrange(3, 3)):
            node = w[i].x * w[j].y * grid[base + ivec2(i, j)]
            u += node.xy
            turn += cmul(node.xy, cconj(vec2(i, j) - f))
            shear += cmul(node.xy, vec2(i, j) - f)
            heap += node.z
        v[p], c[p], d[p] = u, 2.0 / DX * turn, 2.0 / DX * shear
        # region if liquid
        for k in ti.static(LIQUIDS):
            if owner[p] == k:
                q[p] = settle(q[p], heap / (DX**2 * MATTER[k]["density"]), DT)
        # endregion
        moved = x[p] + DT * u
        # region if collider
        for k in ti.static(COLLIDERS):  # thin and fast ones overtake particles
            s = surface(k, moved)
            moved -= ti.min(s.x, 0.0) * s.yz
        # endregion
        x[p] = ti.min(ti.max(moved, 2.0 * DX), 1.0 - 2.0 * DX)


blobs = ti.field(ti.f32, (len(OBJECTS), PIXELS, PIXELS))  # metaballs of each object
COLORS = [bytes.fromhex(o["visualization"]["color"][1:]) for o in OBJECTS]
COLORS = np.array([[0, 0, 0], *map(list, COLORS)], np.uint8)


@ti.kernel
def draw(alive: int, t: float, image: ti.types.ndarray(dtype=ti.u8, ndim=2)):
    """Write the index in COLORS of each pixel at time t; the top row comes first."""
    # region if moving
    for k in ti.static(of_type("kinematic_collider")):
        move(k, OBJECTS[k]["kinematics"], t)
    # endregion
    ti.loop_config(serialize=SERIAL)
    for p in range(alive):
        low = ti.max(ti.floor((x[p] - BLOB) * PIXELS, ti.i32), 0)
        high = ti.min(ti.ceil((x[p] + BLOB) * PIXELS, ti.i32), PIXELS)
        for i, j in ti.ndrange((low.x, high.x), (low.y, high.y)):
            r = (vec2(i, j) + 0.5) / PIXELS - x[p]
            blobs[owner[p], i, j] += ti.max(1.0 - r.dot(r) / BLOB**2, 0.0) ** 2
    ti.loop_config(serialize=SERIAL)
    for i, j in ti.ndrange(PIXELS, PIXELS):
        most, seen = SOLID, 0
        for k in ti.static(range(len(OBJECTS))):
            if blobs[k, i, j] > most:
                most, seen = blobs[k, i, j], k + 1
            blobs[k, i, j] = 0.0
        # region if collider
        for k in ti.static(COLLIDERS):
            if surface(k, (vec2(i, j) + 0.5) / PIXELS).x < 0.0:
                seen = k + 1
        # endregion
        image[PIXELS - 1 - j, i] = ti.cast(seen, ti.u8)


def frames():
    """Yield the frames of the video, each uint8 RGB of shape (PIXELS, PIXELS, 3)."""
    image = np.zeros((PIXELS, PIXELS), np.uint8)
    x.from_numpy(PLACE[ORDER].astype(np.float32))
    v.from_numpy(SPEED[ORDER].astype(np.float32))
    owner.from_numpy(OWNER[ORDER].astype(np.int32))
    for field, rest in zip((a, b, c, d, q), (vec2(1, 0), 0, 0, 0, 1)):
        field.fill(rest)
    for step in range(SIMULATION["duration_frames"] * SIMULATION["substeps_per_frame"]):
        alive = int(np.searchsorted(BIRTH, step, side="right"))
        if step % SIMULATION["substeps_per_frame"] == 0:
            draw(alive, step * DT, image)
            yield COLORS[image]
        particles_to_grid(alive)
        update_grid((step + 1) * DT)
        grid_to_particles(alive)


if __name__ == "__main__":
    codec, size = cv2.VideoWriter_fourcc(*"mp4v"), (PIXELS, PIXELS)
    video = cv2.VideoWriter(sys.argv[1], codec, OUTPUT["framerate"], size)
    for frame in frames():
        video.write(frame[:, :, ::-1])
    video.release()
