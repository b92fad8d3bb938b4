"""The sections of a program, in the order of a story."""

import math

from mpmworlds.sim.program.features.shape import Shape
from mpmworlds.sim.program.linking import texts
from mpmworlds.sim.program.linking.cast import Cast, is_mesh
from mpmworlds.sim.program.linking.layout import WIDTH, indented, literal, number
from mpmworlds.sim.program.linking.places import (
    at_hook,
    fields_of,
    grouped,
    has_area,
    has_mesh,
    pasted,
    several,
    still_groups,
    with_number,
)
from mpmworlds.sim.program.linking.source import (
    Lines,
    body_of,
    library,
    names_read,
    result_of,
)
from mpmworlds.sim.program.linking.writer import Writer
from mpmworlds.sim.scene.steps import frame_time

MPM = (
    "2D Material Point Method: MLS-MPM [Hu et al. 2018], APIC [Jiang et al. 2015]; "
    "SI units."
)
RIGID = "Rigid bodies that meet by sequential impulses [Catto 2005]; SI units."
USE = "`frames()` yields the video; `python program.py out.webm` writes it."
MATH = [
    "cconj",
    "clamp",
    "cmul",
    "cross",
    "ivec2",
    "ivec3",
    "mat2",
    "sign",
    "vec2",
    "vec3",
    "vec4",
]


def header(cast: Cast, body: str) -> str:
    """Docstring and imports of what a program needs."""
    read = names_read(body)
    words = ", ".join(name for name in MATH if name in read)
    doc = f"{texts.sentence(cast.scene)}\n\n{MPM if cast.matter else RIGID}\n{USE}\n"
    math_too = "import math\n" if "math" in read else ""
    own = "import cv2\nimport numpy as np\nimport taichi as ti\n"
    return (
        f'"""{doc}"""\n\n{math_too}import sys\n\n{own}'
        f"from taichi.math import {words}\n\n"
    )


def set_up(cast: Cast, writer: Writer) -> None:
    """Taichi, and the numbers of the whole scene."""
    writer.add(pasted("outline", "set_up"))
    writer.heading("Numbers")
    simulation, output = cast.scene.simulation, cast.scene.output
    time, steps = frame_time(cast.scene), simulation.substeps_per_frame
    short = time / steps == simulation.time_step_dt
    root = math.isqrt(simulation.particles_per_cell)
    whole = root**2 == simulation.particles_per_cell
    per_side = str(root) if whole else f"np.sqrt({simulation.particles_per_cell})"
    dt = f"{number(time)} / {steps}" if short else number(simulation.time_step_dt)
    frames, wall = simulation.duration_frames, cast.scene.environment.walls
    video = f"{frames}, {output.framerate}, {output.resolution}"
    cells = f"{simulation.grid_resolution}, {wall.thickness_cells}"
    lines = [
        f"FRAMES, RATE, PIXELS = {video}",
        f"SUBSTEPS, DT = {steps}, {dt}  # of a frame; time step [s]",
        f"GRID, WALL = {cells}  # in cells",
        f"DX, SPACING = 1 / GRID, 1 / GRID / {per_side}  # of cells, of particles [m]",
        "AREA = SPACING**2  # of a particle [m^2]",
        f"GRAVITY = vec2{literal(cast.scene.environment.gravity)}",
    ]
    writer.add(lines)


def matter(cast: Cast, writer: Writer) -> None:
    """Bodies, nozzles, and the fields of their particles and of the grid."""
    writer.heading("Matter")
    if not cast.matter:
        return
    lines = [*bodies(cast), *nozzles(cast)]
    lines += ["START, N = np.float32(START), len(START)", *particle_fields(cast)]
    writer.add([*lines, *node_fields(cast)])


def bodies(cast: Cast) -> Lines:
    """Rows of the particles of bodies; those of meshes come first."""
    meshes = [thing for thing in cast.bodies if is_mesh(thing)]
    others = [thing for thing in cast.bodies if not is_mesh(thing)]
    lines = shaken(cast) if others else []
    if len(cast.bodies) == 1:
        given = texts.given(cast, cast.bodies[0])
        if meshes:
            return pasted("elastic_fem", "triangulate_one", **given)
        if cast.is_alone:
            return lines + pasted("outline", "fill_alone", **given)
        name = "fill_one_moving" if cast.is_moving else "fill_one"
        return lines + pasted("outline", name, **given)
    if meshes:
        rows = [f"    mesh({texts.body(cast, thing)})," for thing in meshes]
        lines += ["MESHES = [", *rows, "]", *pasted("elastic_fem", "triangulate")]
    rows = [f"    MESHES[{i}][0]," for i in range(len(meshes))]
    rows += [f"    fill({texts.body(cast, thing)})," for thing in others]
    if rows:
        lines += ["PARTS = [", *rows, "]", "START = np.concatenate(PARTS)"]
    return lines


def shaken(cast: Cast) -> Lines:
    """Points of a lattice, shaken."""
    simulation = cast.scene.simulation
    side = simulation.grid_resolution * math.sqrt(simulation.particles_per_cell)
    given = {"seed": str(simulation.seed), "side": str(round(side))}
    return pasted("outline", "shaken", **given)


def nozzles(cast: Cast) -> Lines:
    """Rows of the particles of nozzles, and the steps of their births."""
    if not cast.nozzles:
        return []
    if len(cast.nozzles) == 1:
        given = texts.nozzle(cast, cast.nozzles[0])
        name = "release_alone" if cast.is_alone else "release_one"
        return pasted("outline", name, **given)
    texts_of = [texts.nozzle(cast, thing).values() for thing in cast.nozzles]
    rows = [f"    release({', '.join(values)})," for values in texts_of]
    name = "release_several" if cast.bodies else "release_several_alone"
    return ["RELEASED = [", *rows, "]", *pasted("outline", name)]


def node_fields(cast: Cast) -> Lines:
    """Declarations of the fields of nodes."""
    kind = "vec4" if has_area(cast) else "vec3"
    area = ", area" if has_area(cast) else ""
    lines = [f"Node = {kind}  # momentum, mass{area}"]
    lines += ["grid, flow = (Node.field(shape=(GRID, GRID)) for _ in range(2))"]
    own = {name: library().fields[name] for name in fields_of(cast, "node")}
    vectors = [name for name, field in own.items() if field.kind == "vec2"]
    lines += declared(vectors, "ti.Vector.field(2, float, (GRID, GRID))")
    for name, field in own.items():
        if field.kind == "float":
            lines += [f"{name} = ti.field(float, (GRID, GRID))  # {field.text}"]
    return lines


def particle_fields(cast: Cast) -> Lines:
    """Declarations of the fields of particles."""
    own = {n: library().fields[n] for n in fields_of(cast, "particle")}
    tensors = ["C", "stress", *(n for n, field in own.items() if field.kind == "mat2")]
    scalars = ["mass"] * (not cast.is_alone)
    scalars += [n for n, field in own.items() if field.kind == "float"]
    lines = [
        "x, v = (ti.Vector.field(2, float, N) for _ in range(2))",
        *declared(tensors, "ti.Matrix.field(2, 2, float, N)"),
        *declared(scalars, "ti.field(float, N)"),
    ]
    if several(cast) and cast.nozzles:
        lines += ["owner, birth = (ti.field(int, N) for _ in range(2))  # object, step"]
    elif several(cast):
        lines += ["owner = ti.field(int, N)  # object"]
    elif cast.nozzles:
        lines += ["birth = ti.field(int, N)  # step"]
    if has_mesh(cast):
        lines += pasted("elastic_fem", "fields")
    return lines


def declared(names: list[str], field: str) -> Lines:
    """Declaration of fields of one kind."""
    if len(names) < 2:
        return [f"{name} = {field}" for name in names]
    return [f"{', '.join(names)} = ({field} for _ in range({len(names)}))"]


def solids(cast: Cast, writer: Writer) -> None:
    """What stands around: walls, obstacles, and what moves them."""
    writer.heading("Walls and solids")
    if cast.still and cast.matter and cast.rigid:
        writer.add(["solid = ti.Vector.field(4, float, (2 * GRID, 2 * GRID))"])
    elif cast.still and cast.matter:
        ways = len(still_groups(cast)) > 1
        writer.add(pasted("solids", "bake_which" if ways else "bake"))
        writer.add([f"solid = ti.Vector.field({3 + ways}, float, BAKED.shape[1:])"])
    if cast.movers and not cast.rigid:
        count = len(cast.movers)
        writer.add(
            [
                f"pose = ti.Vector.field(4, float, {count})  # center; cos, sin",
                f"twist = ti.Vector.field(3, float, {count})  # velocity, spin",
            ]
        )
    if cast.timed_belts:
        writer.add(["time = ti.field(float, ())  # for belts [s]"])
    if cast.rigid:
        rigid(cast, writer)
    if cast.matter and cast.movers + cast.rigid:
        shape = "(3, float, (GRID, GRID))"
        writer.add([f"near = ti.Vector.field{shape}  # normal, distance of movers"])
    if cast.solids:
        writer.define("surface")


def rigid(cast: Cast, writer: Writer) -> None:
    """All solids, and the rims of rigid bodies."""
    rims = []
    for thing in cast.rigid:
        line, radius = texts.line(thing.shape), number(thing.shape.roundness())
        rims.append(f"rim({line}, {radius})")
    friction = number(cast.scene.environment.walls.friction)
    walls = f"*(thing(0.5, 0.5, angle, {friction}) for angle in (0, 180, 90, 270))"
    things = [*map(texts.thing, cast.solids), walls]
    lines = [f"    {text}," for text in things]
    writer.define("SWEEPS", "FORESEEN", "YIELD", "BOUNCE")
    writer.add(["THINGS = [", *lines, "]"])
    writer.add([f"RIMS = [{', '.join(rims)}]"])
    writer.add(pasted("rigid", "fields"))
    if cast.matter:
        writer.add(["kick = ti.Vector.field(3, float, BODIES)  # impulse, moment"])


def laws(cast: Cast, writer: Writer) -> None:
    """Constitutive laws."""
    writer.heading("Laws")
    code = "\n".join(line for _, code in grouped(cast, "stress") for line in code)
    writer.define(*(f for f in library().functions if f in names_read(code or "0")))


def step(cast: Cast, writer: Writer) -> None:
    """A step: particles to grid, grid, grid to particles."""
    writer.heading("A step")
    writer.define("substep")


def picture(cast: Cast, writer: Writer) -> None:
    """Colours and drawing."""
    writer.heading("The picture")
    things = cast.matter + cast.rigid + cast.movers + cast.still
    colors = " ".join(["000000", *(o.visualization.color[1:] for o in things)])
    line = f'PALETTE = np.uint8([[*bytes.fromhex(c)] for c in "{colors}".split()])'
    if len(line) > WIDTH:
        code = (
            "PALETTE = np.uint8([[*bytes.fromhex(color)] for color in COLORS.split()])"
        )
        writer.add([f'COLORS = "{colors}"', code])
    else:
        writer.add([line])
    if cast.matter:
        writer.add(pasted("drawing", "blobs"))
        size = f", {len(cast.matter)}" if len(cast.matter) > 1 else ""
        writer.add([f"balls = ti.field(float, (PIXELS, PIXELS{size}))"])
    if cast.still:
        first = 1 + len(cast.matter + cast.rigid + cast.movers)
        kind = "backdrop" if len(cast.still) == 1 else "backdrops"
        kind = "backdrop_unpainted" if cast.rigid else kind
        writer.add(pasted("drawing", kind, first=str(first)))
    writer.define("frames")
    writer.add(pasted("outline", "main"))


def motion(cast: Cast) -> Lines:
    """Function that says where movers are."""
    lines = [
        "def motion(t):",
        '    """Of movers at time t [s]: center, cos, sin of angle, velocity, spin."""',
    ]
    if len(cast.movers) == 1:
        before, row = texts.row(cast.movers[0])
        return [*lines, *indented([*before, returned(row)], 4)]
    lines.append("    rows = []")
    for thing in cast.movers:
        before, row = texts.row(thing)
        lines += indented([*before, f"rows.append(({row}))"], 4)
    return [*lines, "    return np.float32(rows)"]


def returned(row: str) -> str:
    """Statement that returns a row, in parentheses if it needs several lines."""
    line = f"return {row}"
    return line if len(line) <= WIDTH - 4 else f"return ({row})"


def surface(cast: Cast) -> Lines:
    """Function that finds the surface of any solid that moves or is met."""
    end = "" if not cast.rigid else "; walls come last"
    doc = f'    """Outward normal and signed distance [m] of solid k at p{end}."""'
    lines = ["@ti.func", "def surface(k, p):", doc]
    if len(cast.solids) == 1 and not cast.rigid:
        return [*lines, *indented(surface_alone(cast.solids[0].shape), 4)]
    hook = library().hooks["solids", "moving_any"]
    alike: dict[tuple[str, str], list[int]] = {}
    for k, thing in enumerate(cast.solids):
        key = reach_of(thing.shape), texts.in_own_frame(thing.shape)
        alike.setdefault(key, []).append(k)
    chain: Lines = []
    for (far, distance), numbers in alike.items():
        test = with_number(f"if q.norm() < {far}:", "k", numbers)
        chain.append(f"{'el' if chain else ''}{test}")
        chain += [f"    s = {distance}"]
    if cast.rigid:
        wall = "vec3(1.0, 0.0, q.x + 0.5 - WALL * DX)"
        chain += [f"elif k >= {len(cast.solids)}:  # walls", f"    s = {wall}"]
    code = at_hook(body_of(hook, {}), "shapes", chain)
    return [*lines, *indented([*code, f"return {result_of(hook, {})}"], 4)]


def surface_alone(shape: Shape) -> Lines:
    """Body of the function of the surface of one mover."""
    inline = texts.can_stand_inline(shape)
    call = [f"s = {texts.in_own_frame(shape)}"]
    body = texts.inlined_frame(shape) if inline else call
    loops = not inline or any(line.startswith("for ") for line in body)
    hook = library().hooks["solids", "moving_within" if loops else "moving"]
    given = {"far": reach_of(shape)}
    code = body_of(hook, given)
    code[-1:] = indented(body, 4 * loops)
    return [*code, f"return {result_of(hook, given)}"]


def reach_of(shape: Shape) -> str:
    """Text of a distance from its center [m] beyond which a shape does nothing."""
    return f"{number(float(f'{1.001 * shape.reach():.3g}'))} + 2.0 * DX"


def still_alone(cast: Cast) -> Lines:
    """Body of the function of the signed distance of one shape."""
    shape = cast.still[0].shape
    if shape.type in {thing.shape.type for thing in cast.bodies}:
        return [f"return {texts.distance(shape, 'x', 'y')}"]
    return texts.inlined(shape)


def own_functions(cast: Cast) -> dict[str, str]:
    """Functions that only this scene has, with the numbers of its objects."""
    found = {}
    if cast.rigid:
        pass
    elif len(cast.still) == 1:
        found["still"] = "\n".join(
            [
                "def still(x, y):",
                '    """Signed distance [m] from what never moves."""',
                *indented(still_alone(cast), 4),
            ]
        )
    elif cast.still:
        shapes = [f"        {texts.distance(o.shape, 'x', 'y')}," for o in cast.still]
        found["each"] = "\n".join(
            [
                "def each(x, y):",
                '    """Signed distances [m] from what never moves."""',
                *("    return [", *shapes, "    ]"),
            ]
        )
        whole = library().functions["still_of_each"].text
        found["still"] = whole.replace("still_of_each", "still")
    if cast.is_moving:
        moving = library().functions["fill_moving"].text
        found["fill"] = moving.replace("fill_moving", "fill")
    if cast.movers:
        found["motion"] = "\n".join(motion(cast))
    if not (cast.movers or cast.nozzles or cast.timed_belts):
        steps = "for step in range(SUBSTEPS * n, SUBSTEPS * (n + 1)):"
        whole = library().functions["frames"].text
        assert steps in whole
        found["frames"] = whole.replace(steps, "for _ in range(SUBSTEPS):")
    if not cast.matter:
        alone = library().functions["substep_of_bodies"].text
        found["substep"] = alone.replace("substep_of_bodies", "substep")
    if cast.solids:
        found["surface"] = "\n".join(surface(cast))
    return found


SECTIONS = (set_up, matter, solids, laws, step, picture)
