"""Contact of matter with solids: ramps, belts, bounces, leaks."""

import numpy as np
from benchmarks.physics.case import (
    Curve,
    Floats,
    Plot,
    Result,
    at_least,
    at_most,
    case,
    near,
)
from benchmarks.physics.world import (
    WALL,
    G,
    block,
    body,
    box,
    cut,
    disc,
    machine,
    matter,
    nozzle,
    obstacle,
    simulate,
    square_law,
    world,
)

from mpmworlds.sim.scene.scene import Scene


def signed_depth(scene: Scene, index: int, pose: Floats, points: Floats) -> Floats:
    """Depth [m] of points (n, 2) in an object at a pose; negative outside."""
    shape = scene.objects[index].shape
    shift = pose[0] - shape.center[0], pose[1] - shape.center[1]
    parts = shape.outline(shift, float(pose[2]) - shape.angle())
    depth: Floats = np.max([_in_polygon(part, points) for part in parts], axis=0)
    return depth


def _in_polygon(corners: Floats, points: Floats) -> Floats:
    """Depth [m] of points (n, 2) in one polygon (m, 2)."""
    depth = np.full(len(points), -np.inf)
    low, high = corners.min(axis=0), corners.max(axis=0)
    near_it = ((points >= low) & (points <= high)).all(axis=1)
    p = points[near_it, None]
    start, end = corners, np.roll(corners, -1, axis=0)
    edge, w = end - start, p - start
    along = (w * edge).sum(axis=2) / (edge**2).sum(axis=1)
    away = w - along.clip(0.0, 1.0)[..., None] * edge
    far = np.sqrt((away**2).sum(axis=2).min(axis=1, initial=np.inf))
    above = (start[:, 1] > p[..., 1]) != (end[:, 1] > p[..., 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = start[:, 0] + w[..., 1] * edge[:, 0] / edge[:, 1]
    odd = (above & (p[..., 0] < cross)).sum(axis=1) % 2 == 1
    depth[near_it] = np.where(odd, far, -far)
    return depth


@case(coarse=48, fine=96)
def blocks_on_ramps_slide_as_coulomb_says(cells: int) -> Result:
    """At 20 degrees, friction 0.15 lets them slide and 0.6 holds them."""
    angle, size, length = 20.0, 0.1, 0.44
    turn = np.radians(angle)
    along = np.array([np.cos(turn), np.sin(turn)])
    across = np.array([-along[1], along[0]])
    things, marks = [], []
    for row, friction in ((0.25, 0.15), (0.68, 0.6)):
        for column, model in ((0.27, "elastic"), (0.73, "rigid")):
            middle = np.array([column, row])
            top = middle + 0.03 * across
            place = top + 0.12 * along + 0.5 * size * across
            stuff = matter(model, friction=friction) if model == "rigid" else None
            stuff = stuff or matter(model, youngs_modulus=8e5)
            ramp = box(tuple(middle), length, 0.06, angle=angle)
            things += [
                body(box(tuple(place), size, size, angle=angle), stuff),
                obstacle(ramp, friction=friction),
            ]
            marks.append((len(things) - 2, model, friction))
    scene = world(*things, cells=cells, seconds=0.4)
    record = simulate(scene)
    checks, curves, t = [], [], record.time
    for index, model, friction in marks:
        rigid = model == "rigid"
        place = record.pose(index)[:, :2] if rigid else record.x(index).mean(axis=1)
        way = -(place - place[0]) @ along
        curves.append(Curve(f"{model}, friction {friction}", t, way))
        late = (t > 0.05) & (t < 0.3)
        found = square_law(t[late], way[late])
        pull = G * (np.sin(turn) - friction * np.cos(turn))
        source, name = "g (sin - mu cos)", f"{model}, friction {friction}"
        if pull > 0.0:
            checks.append(near(f"{name}: a [m/s2]", found, pull, 0.1, source))
        else:
            checks.append(
                at_most(f"{name}: way [cells]", way[-1] * cells, 0.5, "holds")
            )
    theory = 0.5 * G * (np.sin(turn) - 0.15 * np.cos(turn)) * t**2
    curves.append(Curve("g (sin - mu cos)", t, theory, reference=True))
    return Result(checks, [Plot("Blocks on ramps", "t [s]", "way [m]", curves)])


@case(coarse=48, fine=96)
def a_belt_carries_blocks_at_its_speed(cells: int) -> Result:
    """They accelerate at mu g until they have the speed of the belt."""
    speed, friction = 0.5, 0.3
    belt = {"type": "conveyor", "surface_speed": speed}
    things = []
    for height, model in ((0.25, "elastic"), (0.7, "rigid")):
        plate = box((0.5, height), 0.8, 0.1)
        stuff = matter(model, friction=friction) if model == "rigid" else matter(model)
        things += [
            body(block(0.2, height + 0.05, 0.12, 0.12), stuff),
            machine(plate, belt, friction=friction),
        ]
    record = simulate(world(*things, cells=cells, seconds=0.6))
    checks, curves, t = [], [], record.time
    for index, model in ((0, "elastic"), (2, "rigid")):
        rigid = model == "rigid"
        u = record.rate(index)[:, 0] if rigid else record.v(index)[..., 0].mean(axis=1)
        early = (t > 0.03) & (t < 0.12)
        gain = np.polyfit(t[early], u[early], 1)[0]
        checks += [
            near(f"{model}: a [m/s2]", gain, friction * G, 0.1, "mu g"),
            near(f"{model}: speed at last [m/s]", u[-10:].mean(), speed, 0.03, "belt"),
        ]
        curves.append(Curve(model, t, u))
    expected = np.minimum(friction * G * t, speed)
    curves.append(Curve("min(mu g t, belt)", t, expected, reference=True))
    return Result(checks, [Plot("Blocks on a belt", "t [s]", "u [m/s]", curves)])


@case(coarse=48, fine=96)
def nothing_bounces_higher_than_it_fell(cells: int) -> Result:
    """A rigid disc rises to restitution^2 of its drop, an elastic one below all."""
    radius, restitution, drop, edge = 0.08, 0.6, 0.5, WALL / cells
    y = edge + radius + drop
    scene = world(
        body(disc((0.3, y), radius), matter("rigid", restitution=restitution)),
        body(disc((0.7, y), radius), matter("elastic", youngs_modulus=2e5)),
        cells=cells,
        seconds=1.0,
        frame=0.005,
    )
    record = simulate(scene)
    heights = [
        record.pose(0)[:, 1] - edge - radius,
        record.x(1)[..., 1].mean(axis=1) - edge - radius,
    ]
    checks = []
    for name, h in zip(("rigid", "elastic"), heights, strict=True):
        low = int(h[:110].argmin())
        rise = float(h[low:].max())
        source = "energy"
        checks.append(at_most(f"{name}: rise / drop", rise / drop, 1.0, source))
        if name == "rigid":
            part = restitution**2
            checks.append(near("rigid: rise / drop", rise / drop, part, 0.1, "e^2"))
            most = -float(h.min()) * cells
            checks.append(
                at_most("rigid: depth in floor [cells]", most, 0.5, "contact")
            )
        else:
            checks.append(at_least("elastic: rise / drop", rise / drop, 0.3, "bounces"))
    curves = [
        Curve(name, record.time, h)
        for name, h in zip(("rigid", "elastic"), heights, strict=True)
    ]
    return Result(checks, [Plot("Bouncing discs", "t [s]", "height [m]", curves)])


@case(coarse=48, fine=96)
def a_fast_fan_in_water_leaks_nothing_and_turns_it(cells: int) -> Result:
    """At 30 rad/s, in water that falls in from both sides."""
    edge, hub, reach, spin = WALL / cells, (0.5, 0.3), 0.16, 30.0
    side, high = cut(0.5 - reach - edge, cells) - 2 / cells, cut(0.5, cells)
    blades = {
        "type": "fan_blades",
        "center": hub,
        "blade_count": 4,
        "blade_length": reach,
        "thickness": 2.0 / cells,
    }
    scene = world(
        machine(blades, {"type": "rotate", "angular_velocity": spin}),
        body(block(edge, edge, side, high), matter("liquid")),
        body(block(1.0 - edge - side, edge, side, high), matter("liquid")),
        cells=cells,
        seconds=0.6,
    )
    record = simulate(scene)
    x, v = record.states.positions, record.states.velocities
    frames = range(1, len(record.time), 3)
    pose = record.pose(0)
    depth = max(signed_depth(scene, 0, pose[t], x[t]).max() for t in frames)
    arm = x - np.array(hub)
    turning = (arm[..., 0] * v[..., 1] - arm[..., 1] * v[..., 0]).mean(axis=1)
    bound = 1.5 * (spin * (reach + 1 / cells) + (2 * G * high) ** 0.5)
    fastest = float(np.hypot(*v.T).max())
    source = "inelastic contact: tip + fall, and half of it"
    curves = [Curve("water", record.time, turning)]
    return Result(
        [
            at_most("deepest in a blade [cells]", depth * cells, 0.1, "no leak"),
            at_least("angular momentum / mass [m2/s]", turning[-1], 0.05, "sign"),
            at_most("fastest [m/s]", fastest, bound, source),
        ],
        [Plot("Water around a fan", "t [s]", "L / m [m2/s]", curves)],
    )


@case(coarse=48, fine=96)
def a_thin_plate_holds_a_falling_column(cells: int) -> Result:
    """1.5 cells thick; nothing gets below it or into it."""
    plate = obstacle(block(0.0, 0.3, 1.0, 1.5 / cells))
    column = body(block(0.4, 0.5, 0.2, 0.4), matter("liquid"), (0.0, -2.0))
    record = simulate(world(column, plate, cells=cells, seconds=0.6))
    lowest = (record.x(0)[..., 1].min() - 0.3) * cells - 1.5
    return Result([at_least("lowest above it [cells]", lowest, -0.1, "no leak")])


@case(coarse=48, fine=96)
def nozzles_release_the_mass_of_their_rate(cells: int) -> Result:
    """Mass is rate x time x mass of a particle, for jet, hose and rain."""
    spacing, side = 0.5 / cells, 0.08
    full = side * 1.5 / spacing**2
    rates = {"jet": 0.9 * full, "hose": 0.6 * full, "rain": 0.25 * full}
    drop = 0.025
    kinds = {
        "jet": {},
        "hose": {"swing_deg": 20.0, "period": 0.5},
        "rain": {"drop_radius": drop},
    }
    things = []
    for x, (kind, more) in zip((0.2, 0.5, 0.8), kinds.items(), strict=True):
        emission = {
            "type": kind,
            "rate": rates[kind],
            "velocity": [0.0, -1.5],
            "start": 0.05,
            "stop": 0.3,
        }
        things.append(nozzle(box((x, 0.85), side, 0.04), emission | more))
    record = simulate(world(*things, cells=cells, seconds=0.35))
    born, mass = record.states.born, record.states.mass
    checks = []
    for index, kind in enumerate(kinds):
        mine = record.states.object_id == index
        found = (born[:, mine] * mass[mine]).sum(axis=1)
        time = record.time.clip(0.05, 0.3) - 0.05
        expected = rates[kind] * time * 1e3 * spacing**2
        grain = (
            1e3
            * spacing**2
            * (round(np.pi * drop**2 / spacing**2) if index == 2 else 1)
        )
        off = abs(found - expected).max() / grain
        checks.append(
            at_most(f"{kind}: mass off by particles or drops", off, 1.5, "rate x time")
        )
    return Result(checks)
