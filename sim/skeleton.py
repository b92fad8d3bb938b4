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
from taichi.math import cconj, cmul, ivec2, vec2, vec3, vec4

from mpmworlds.sim.physics.contact import touch
from mpmworlds.sim.physics.deformation import advance, newtonian
from mpmworlds.sim.physics.elastic import fixed_corotated, lame
from mpmworlds.sim.physics.liquid import compress, settle
from mpmworlds.sim.physics.motion import rotate
from mpmworlds.sim.physics.shapes import sd_box, sd_fan, sd_polygon
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
        "visualization": {"color": "#F52D2C"},
    },
    {
        "name": "object_1",
        "object_type": "static_collider",
        "shape": {
            "type": "polygon",
            "center": [0.3, 0.3],
            "angle_deg": 0.0,
            "vertices": [[-0.1, -0.06], [0.1, -0.06], [0.0, 0.08]],
        },
        "contact": {"type": "separate", "friction": 0.2, "skin_cells": 0.3},
        "visualization": {"color": "#969696"},
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
        "visualization": {"color": "#F5F42C"},
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
        "emission": {"rate": 900.0, "velocity": [1.0, 0.0], "start": 0.0, "stop": 0.5},
        "visualization": {"color": "#2C2DF5"},
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
BLOB = 1.85 * SPACING  # radius of the metaball that a particle is drawn as
SOLID = 0.9  # sum of metaballs from which a pixel is covered

ti.init(
    arch=ti.cpu,
    cpu_max_num_threads=1,  # so that every run gives the same bits
    fast_math=False,
    cfg_optimization=False,  # it compiles a quarter faster and runs as fast
    log_level=ti.WARN,
)
SERIAL = ti.cfg.arch in (ti.x64, ti.arm64)  # on a GPU the same loops run in parallel


def of_type(object_type):
    """Indices of the objects of a type."""
    return [k for k, o in enumerate(OBJECTS) if o["object_type"] == object_type]


# region physics
# endregion


N_OBJECTS = len(OBJECTS)
MATTER = [o.get("physics_properties", {}) for o in OBJECTS]
# region if liquid
LIQUIDS = [k for k, m in enumerate(MATTER) if m.get("constitutive_model") == "liquid"]
# endregion
SHAPES = [o["shape"] for o in OBJECTS]
HOME = [[*s["center"], np.radians(s.get("angle_deg", 0.0))] for s in SHAPES]
# region if solid
pose = ti.Vector.field(4, ti.f32, N_OBJECTS)  # center x, y [m]; cos, sin of angle
kind = ti.field(ti.i32, N_OBJECTS)  # of shape, index in KINDS
measure = ti.Vector.field(4, ti.f32, N_OBJECTS)  # of the shape; radius around it [m]
# region if polygon
POLYGONS = [k for k, shape in enumerate(SHAPES) if shape["type"] == "polygon"]
corners = ti.Vector.field(2, ti.f32, (N_OBJECTS, 16))  # of polygons [m]
# endregion


# region shapes
KINDS = {"box": 0, "fan_blades": 1, "polygon": 2}


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
MEASURES = [measures(shape) for shape in SHAPES]


@ti.func
def surface(k, p):
    """Signed distance [m] of p from object k, a bound from afar, and outward normal."""
    arm, turn = p - pose[k].xy, pose[k].zw
    s = vec3(arm.norm() - measure[k].w, arm)
    if s.x < DX:
        s = distance(k, cmul(arm, cconj(turn)))
        s = vec3(s.x, cmul(turn, s.yz))
    return s


# endregion
# region if collider
COLLIDERS = of_type("static_collider") + of_type("kinematic_collider")
N_COLLIDERS = len(COLLIDERS)
TOUCH = [OBJECTS[k]["contact"] for k in COLLIDERS]
CONTACTS = [[LAWS[c["type"]], c["friction"], DX * c["skin_cells"]] for c in TOUCH]
collider = ti.field(ti.i32, N_COLLIDERS)  # index of the object
contact = ti.Vector.field(3, ti.f32, N_OBJECTS)  # law; friction; skin [m]
twist = ti.Vector.field(4, ti.f32, N_OBJECTS)  # velocity x, y [m/s]; spin; belt [m/s]
room = ti.field(ti.f32, (N_GRID, N_GRID))  # distance to the nearest collider [m]
# endregion


# region if moving
# region motion
@ti.func
def move(k: ti.template(), motion: ti.template(), t):
    """Put collider k where its motion has it at time t [s]."""
    moved, rate = rotate(t, motion["angular_velocity"])
    now, twist[k] = vec3(HOME[k]) + moved, rate
    pose[k] = vec4(now.xy, ti.cos(now.z), ti.sin(now.z))


# endregion
# endregion
# region if solid
@ti.kernel
def set_up():
    """Enter shape, place and contact of every object."""
    for k in ti.static(range(N_OBJECTS)):
        kind[k], measure[k] = KINDS[SHAPES[k]["type"]], vec4(MEASURES[k])
        pose[k] = vec4(HOME[k][0], HOME[k][1], ti.cos(HOME[k][2]), ti.sin(HOME[k][2]))
    # region if polygon
    for k in ti.static(POLYGONS):
        for i in ti.static(range(len(SHAPES[k]["vertices"]))):
            corners[k, i] = vec2(SHAPES[k]["vertices"][i])
    # endregion
    # region if collider
    for n in ti.static(range(N_COLLIDERS)):
        collider[n], contact[COLLIDERS[n]] = COLLIDERS[n], vec3(CONTACTS[n])
    # endregion


# endregion
# region if body
@ti.kernel
def mark_inside(k: int, points: ti.types.ndarray(), inside: ti.types.ndarray()):
    """Whether each point is inside object k."""
    ti.loop_config(serialize=SERIAL)
    for p in range(points.shape[0]):
        inside[p] = surface(k, vec2(points[p, 0], points[p, 1])).x < 0.0


def fill_bodies():
    """Particles on a jittered lattice: object, birth step, position, velocity."""
    rng = np.random.Generator(np.random.Philox(SIMULATION["seed"]))
    cells = np.argwhere(np.ones((round(1 / SPACING), round(1 / SPACING))))
    points = SPACING * (cells + 0.25 + 0.5 * rng.random(cells.shape))
    inside = np.empty(len(points), np.int32)
    for k in of_type("dynamic_body"):
        mark_inside(k, points.astype(np.float32), inside)
        place, state = points[inside > 0], OBJECTS[k]["initial_state"]
        arm = (place - HOME[k][:2])[:, ::-1] * [-1, 1]  # turned by 90 degrees
        velocity = state["velocity"] + state["angular_velocity"] * arm
        yield np.full(len(place), k), np.zeros(len(place), int), place, velocity


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
# region if solid
set_up()
# endregion
GROUPS = []
# region if body
GROUPS += fill_bodies()
# endregion
# region if emitter
GROUPS += fill_jets()
# endregion
OWNER, BIRTH, PLACE, SPEED = map(np.concatenate, zip(*GROUPS, strict=True))
ORDER = np.argsort(BIRTH, kind="stable")  # so that the living come first
OWNER, BIRTH = OWNER[ORDER].astype(np.int32), BIRTH[ORDER]
PLACE, SPEED = PLACE[ORDER].astype(np.float32), SPEED[ORDER].astype(np.float32)

x, v, c, d, a, b = (ti.Vector.field(2, ti.f32) for _ in range(6))
q, owner = ti.field(ti.f32), ti.field(ti.i32)  # state of the material; object
ti.root.dense(ti.i, len(ORDER)).place(x, v, c, d, a, b, q, owner)
grid = ti.Vector.field(3, ti.f32, (N_GRID, N_GRID))  # momentum or velocity; mass


@ti.kernel
def give_birth(
    place: ti.types.ndarray(), speed: ti.types.ndarray(), owners: ti.types.ndarray()
):
    """Put every particle where it will be born, without strain."""
    for p in range(place.shape[0]):
        x[p], v[p] = vec2(place[p, 0], place[p, 1]), vec2(speed[p, 0], speed[p, 1])
        a[p], b[p], c[p], d[p] = vec2(1.0, 0.0), vec2(0.0), vec2(0.0), vec2(0.0)
        q[p], owner[p] = 1.0, owners[p]
        # region if body
        for k in ti.static(of_type("dynamic_body")):
            if owners[p] == k:
                c[p].y = OBJECTS[k]["initial_state"]["angular_velocity"]
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
            room[i, j] = 1.0
            for n in range(N_COLLIDERS):
                k, node = collider[n], DX * vec2(i, j)
                s = surface(k, node)
                room[i, j] = ti.min(room[i, j], s.x)
                if s.x < contact[k].z:
                    arm, belt = node - pose[k].xy, twist[k].w * vec2(s.z, -s.y)
                    rigid = twist[k].xy + cmul(vec2(0.0, twist[k].z), arm) + belt
                    g = touch(g, rigid, s.yz, contact[k].x, contact[k].y)
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
        if room[base + 1] < 2.0 * DX:
            for n in range(N_COLLIDERS):  # thin and fast ones overtake particles
                s = surface(collider[n], moved)
                moved -= ti.min(s.x, 0.0) * s.yz
        # endregion
        x[p] = ti.min(ti.max(moved, 2.0 * DX), 1.0 - 2.0 * DX)


blobs = ti.field(ti.f32, (N_OBJECTS, PIXELS, PIXELS))  # metaballs of each object
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
        for k in range(N_OBJECTS):
            if blobs[k, i, j] > most:
                most, seen = blobs[k, i, j], k + 1
            blobs[k, i, j] = 0.0
        # region if collider
        for n in range(N_COLLIDERS):
            if surface(collider[n], (vec2(i, j) + 0.5) / PIXELS).x < 0.0:
                seen = collider[n] + 1
        # endregion
        image[PIXELS - 1 - j, i] = ti.cast(seen, ti.u8)


def frames():
    """Yield the frames of the video, each uint8 RGB of shape (PIXELS, PIXELS, 3)."""
    image = np.zeros((PIXELS, PIXELS), np.uint8)
    give_birth(PLACE, SPEED, OWNER)
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
