"""Code for the hooks of the outline: what the features of a scene do at each place."""

import re
from collections.abc import Sequence
from typing import Any

from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.program.linking.cast import Cast, is_mesh, is_rigid
from mpmworlds.sim.program.linking.layout import indented, literal, number
from mpmworlds.sim.program.linking.source import Lines, body_of, library

Group = tuple[list[int], Lines]
FULL = ["full = ti.max(full, 1.0)"]


def pasted(module: str, name: str, **texts: str) -> Lines:
    """Statements of a hook with texts in place of some of its parameters."""
    return body_of(library().hooks[module, name], texts)


def places_of(cast: Cast) -> dict[str, Lines]:
    """What stands at each hook that the scene has something for."""
    places = {
        "place": place(cast),
        "bake": bake(cast),
        "launch": launch(cast),
        "paint": paint(cast),
        "throw": pasted("elastic_fem", "throw") if cast.is_moving else [],
        "weigh": weigh(cast) if cast.matter else [],
        "share": pasted("outline", "share_area" if has_area(cast) else "share"),
        "fullness": pasted("outline", "fullness") if has_area(cast) else [],
        "enter": pasted(
            "outline", f"enter_{'fullness' if has_area(cast) else 'velocity'}"
        ),
        "unborn": pasted("outline", "unborn") if cast.nozzles else [],
        "unborn_yet": unborn_yet(cast) if cast.nozzles else [],
        "stress": stress(cast),
        "scatter": matter_at(cast, "scatter"),
        "solids": solids(cast) if cast.matter else [],
        "walls": walls(cast),
        "settle": matter_at(cast, "settle"),
        "push_out": push_out(cast) if cast.matter else [],
        "tighten": tighten(cast),
        "kicks": pasted("rigid", "kicks") if cast.rigid and cast.matter else [],
        "belts": belts(cast),
        "tick": tick(cast),
        "bodies": bodies(cast),
        "balls": balls(cast),
        "seen": seen(cast),
        "start": start(cast),
        "substep": substep(cast),
        "backdrop": backdrop(cast),
        "skip": ["continue"],
    }
    nodes = fields_of(cast, "node")
    return places | {"clear": [f"{name}[i, j] = 0.0" for name in nodes]}


def place(cast: Cast) -> Lines:
    """Particles where they start, with the fields of their materials."""
    if not cast.matter:
        return []
    first, lines = 0, ["for p in range(N):"]
    if not cast.is_alone:
        owned = "owner[p], mass[p] = int(start[p, 0]), start[p, 1]"
        first, lines = 2, [*lines, owned if several(cast) else "mass[p] = start[p, 1]"]
    lines += ["birth[p] = int(births[p])"] if cast.nozzles else []
    place, speed = (
        f"vec2(start[p, {i}], start[p, {i + 1}])" for i in (first, first + 2)
    )
    if cast.is_alone and not cast.nozzles:
        speed = f"vec2{literal(cast.bodies[0].initial_state.velocity)}"
    speed = speed if cast.is_moving else "vec2(0.0)"
    lines += [f"x[p], v[p] = {place}, {speed}"]
    alike = [n for n in fields_of(cast, "particle") if not start_differs(cast, n)]
    starts = {"C": "mat2(0.0)"} | {name: start_of(cast, name) for name in alike}
    for some in (
        [n for n in starts if n in "CF"],
        [n for n in starts if n not in "CF"],
    ):
        left = ", ".join(f"{name}[p]" for name in some)
        lines += [f"{left} = {', '.join(starts[n] for n in some)}"] if some else []
    for name in fields_of(cast, "particle"):
        if start_differs(cast, name):
            lines += starts_of(cast, name)
    lines = [lines[0], *indented(lines[1:] + turning(cast), 4)]
    return lines + (pasted("elastic_fem", "weave") if has_mesh(cast) else [])


def weigh(cast: Cast) -> Lines:
    """Mass and velocity of a particle."""
    if not cast.is_alone:
        return pasted("outline", "weigh")
    return pasted("outline", "weigh_alike")


def unborn_yet(cast: Cast) -> Lines:
    """What is not born yet, and never if its place is taken."""
    room: Lines = []
    if cast.firm:
        here = "grid[at].z" if len(cast.firm) == len(cast.matter) else "firm[at]"
        own = "MASS" if cast.is_alone else "mass[p]"
        room += pasted("outline", "beside", here=here, m=own)
    count = len(cast.rigid + cast.movers)
    room += pasted("outline", "covered", count=str(count)) if count else []
    if not room:
        return pasted("outline", "unborn")
    return at_hook(pasted("outline", "unborn_yet"), "room", room)


def turning(cast: Cast) -> Lines:
    """Statements that give bodies the spin that they start with."""
    lines: Lines = []
    for k, thing in enumerate(cast.matter):
        spin = getattr(getattr(thing, "initial_state", None), "angular_velocity", 0.0)
        x, y = map(number, thing.shape.center)
        code = pasted("outline", "turn", spin=number(spin), cx=x, cy=y) if spin else []
        if code and several(cast):
            code = [f"if {is_one_of([k])}:", *indented(code, 4)]
        lines += code
    return lines


def bake(cast: Cast) -> Lines:
    """What never moves, on the grid."""
    if not (cast.still and cast.matter):
        return []
    if cast.rigid:
        return pasted("rigid", "survey", **texts_of(rest_of(cast)))
    return pasted("solids", "enter")


def rest_of(cast: Cast) -> Numbers:
    """Numbers of the first solid that never moves, and of the one after the last."""
    return {"first": len(cast.rigid + cast.movers), "last": len(cast.solids)}


def paint(cast: Cast) -> Lines:
    """What never moves, in the picture, if it has a Taichi function."""
    if not (cast.still and cast.rigid):
        return []
    numbers = rest_of(cast) | {"number": 1 + len(cast.matter)}
    return pasted("rigid", "paint", **texts_of(numbers))


def has_area(cast: Cast) -> bool:
    """Whether the grid must know which part of it is filled."""
    code = [*grouped(cast, "settle"), *grouped(cast, "stress")]
    return any("g.w" in line for _, lines in code for line in lines)


def given_starts(cast: Cast, name: str) -> dict[int, float]:
    """First values of a field that materials give, by the number of the object."""
    start = library().fields[name].start
    values = {k: getattr(m, start, None) for k, m in enumerate(cast.materials)}
    return {k: value for k, value in values.items() if value is not None}


def start_differs(cast: Cast, name: str) -> bool:
    """Whether the first values of a field differ between objects."""
    return len(set(given_starts(cast, name).values())) > 1


def start_of(cast: Cast, name: str) -> str:
    """Text of the first value of a field that is the same for all."""
    given = given_starts(cast, name)
    return number(given.popitem()[1]) if given else library().fields[name].start


def starts_of(cast: Cast, name: str) -> Lines:
    """Statements that give a field of particles first values that differ."""
    return [
        line
        for k, value in given_starts(cast, name).items()
        for line in (f"if owner[p] == {k}:", f"    {name}[p] = {number(value)}")
    ]


def launch(cast: Cast) -> Lines:
    """Moving solids where they start, and what rigid bodies are."""
    if cast.rigid:
        return pasted("rigid", "launch")
    if not cast.movers:
        return []
    return pasted("solids", "launch_one" if len(cast.movers) == 1 else "launch")


def start(cast: Cast) -> Lines:
    """Call that puts everything where it starts."""
    solids = "motion(0.0)", "THINGS", "RIMS", "BACKDROP"
    given = "START", "BIRTH", "TRIANGLES", "BAKED", *solids
    return [f"place({', '.join(given)})"]


def fields_of(cast: Cast, per: str) -> list[str]:
    """Names of the fields of materials over particles or nodes, in order of use."""
    code = [
        line
        for at in ("stress", "scatter", "settle")
        for _, lines in grouped(cast, at)
        for line in lines
    ]
    known = [name for name, field in library().fields.items() if field.per == per]
    return [name for name in known if any(f"{name}[" in line for line in code)]


def has_mesh(cast: Cast) -> bool:
    """Whether a body is a mesh."""
    return any(map(is_mesh, cast.matter))


def several(cast: Cast) -> bool:
    """Whether particles must know which object they belong to."""
    return len(cast.matter) > 1


def stress(cast: Cast) -> Lines:
    """Strain and stress of every object of matter."""
    return by_owner(grouped(cast, "stress"), "tau")


def by_owner(groups: list[Group], name: str) -> Lines:
    """Code of the group that a particle belongs to, which sets a matrix of a name."""
    if len(groups) <= 1:
        return groups[0][1] if groups else []
    lines = [f"{name} = mat2(0.0)"]
    for i, (numbers, code) in enumerate(groups):
        lines += [f"{'elif' if i else 'if'} {is_one_of(numbers)}:", *indented(code, 4)]
    return lines


def matter_at(cast: Cast, at: str) -> Lines:
    """What some objects of matter do at another place."""
    lines: Lines = []
    for numbers, code in grouped(cast, at):
        if len(numbers) == len(cast.matter):
            lines += code
        elif code:
            lines += [f"if {is_one_of(numbers)}:", *indented(code, 4)]
    return lines


def grouped(cast: Cast, at: str) -> list[Group]:
    """Numbers of the objects of matter that do the same at a place, and what."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for k in range(len(cast.matter)):
        code = [
            line
            for module, name, numbers in cast.calls(k)
            if library().hooks[module, name].place == at
            for line in pasted(module, name, **texts_of(numbers))
        ]
        groups.setdefault(tuple(code), []).append(k)
    return [(numbers, list(code)) for code, numbers in groups.items()]


def texts_of(numbers: Numbers) -> dict[str, str]:
    """Numbers as texts."""
    return {name: number(value) for name, value in numbers.items()}


def is_one_of(numbers: Sequence[int]) -> str:
    """Text of the test that a particle belongs to one of some objects."""
    return " or ".join(f"owner[p] == {k}" for k in numbers)


def solids(cast: Cast) -> Lines:
    """Contact of the grid with colliders and rigid bodies."""
    moving = cast.rigid + cast.movers
    groups: dict[tuple[str, ...], list[int]] = {}
    for k, thing in enumerate(moving):
        groups.setdefault(tuple(meet_moving(cast, thing)), []).append(k)
    lines = touch_still(cast)
    if not moving:
        return lines
    if len(moving) == 1 and not cast.still:
        (code,) = groups
        alone = [with_name(line, "k", "0") for line in code]
        return [*pasted("solids", "see_one"), *alone]
    lines += ["far = q.z" if cast.still else "far = 1.0"]
    lines += [f"for k in range({len(moving)}):"]
    lines += indented(pasted("solids", "see"), 4)
    for i, (code, numbers) in enumerate(groups.items()):
        test, *rest = code
        if len(groups) > 1:
            test = with_number(test, "k", numbers)
        lines += indented([f"{'el' if i else ''}{test}", *rest], 4)
    return [*lines, "near[i, j] = far"]


def with_number(test: str, name: str, numbers: list[int]) -> str:
    """An `if` that also asks whether a name is one of some numbers."""
    which = " or ".join(f"{name} == {k}" for k in numbers)
    which = f"({which})" if len(numbers) > 1 else which
    return test.replace("if ", f"if {which} and ")


def with_name(line: str, name: str, text: str) -> str:
    """A line with a text in place of a name."""
    return re.sub(rf"\b{name}\b", text, line)


def touch_still(cast: Cast) -> Lines:
    """Contact with what never moves, those of equal contact together."""
    groups = still_groups(cast)
    lines: Lines = []
    for code, numbers in groups.items():
        first, test, *rest = code
        lines += [first] if not lines else []
        if len(groups) > 1:
            test = with_number(test, "q.w", numbers)
        lines += [test, *rest]
    return lines


def still_groups(cast: Cast) -> dict[tuple[str, ...], list[int]]:
    """Numbers of things that never move by the code of their contact."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for k, thing in enumerate(cast.still):
        code = pasted("solids", "touch_still", skin=number(thing.contact.skin_cells))
        touch = contact(cast, "touch", thing.contact, u="u", n="q.xy")
        if thing.object_type == "kinematic_collider":
            touch = [f"w = {belt(thing)} * vec2(q.y, -q.x)"]
            touch += contact(cast, "meet", thing.contact, u="u", w="w", n="q.xy")
        groups.setdefault(tuple(at_hook(code, "contact", touch)), []).append(k)
    return groups


def belt(thing: object) -> str:
    """Text of the speed of a belt."""
    motion = thing.kinematics  # type: ignore[attr-defined]
    speed = number(motion.surface_speed)
    if not motion.is_timed():
        return speed
    start, stop = number(motion.start), number(motion.stop)
    return f"ti.select({start} <= time[None] and time[None] < {stop}, {speed}, 0.0)"


def meet_moving(cast: Cast, thing: Any) -> Lines:
    """Contact with moving solid k."""
    rigid = is_rigid(thing)
    touched = thing.physics_properties if rigid else thing.contact
    touch = contact(cast, "meet", touched, u="u", w="w", n="s.xy")
    if rigid:
        touch = at_hook(pasted("rigid", "kicked"), "touch", touch)
    name = "meet_one" if cast.solids == [thing] else "meet_moving"
    code = pasted("solids", name, skin=number(touched.skin_cells))
    return at_hook(code, "contact", touch)


def contact(cast: Cast, name: str, touched: Any, **texts: str) -> Lines:
    """Statements of a contact law; space is full where matter touches something."""
    law = getattr(touched, "type", "separate")
    lines = pasted(law, name, friction=number(touched.friction), **texts)
    return lines + FULL * has_area(cast)


def at_hook(code: Lines, name: str, lines: Lines) -> Lines:
    """Code with lines in place of one of its hooks."""
    filled: Lines = []
    for line in code:
        spaces = len(line) - len(line.lstrip())
        here = line.lstrip().startswith(f"hook.{name}(")
        filled += indented(lines, spaces) if here else [line]
    return filled


def tighten(cast: Cast) -> Lines:
    """Stress of the triangles of meshes."""
    return by_owner([group for group in grouped(cast, "tighten") if group[1]], "P")


def belts(cast: Cast) -> Lines:
    """Speeds of belts, for rigid bodies."""
    lines: Lines = []
    for k, thing in enumerate(cast.solids):
        if getattr(thing, "kinematics", None) and thing.kinematics.type == "conveyor":
            lines += [f"if k == {k}:", f"    u += {belt(thing)} * vec2(n.y, -n.x)"]
    return lines


def walls(cast: Cast) -> Lines:
    """Contact of the grid with the four walls."""
    if not cast.matter:
        return []
    law, area = cast.scene.environment.walls, FULL * has_area(cast)
    if law.contact == "sticky":
        test = "if ti.min(i, j) <= WALL or ti.max(i, j) >= GRID - WALL:"
        return [test, *indented([*pasted("sticky", "touch"), *area], 4)]
    lines: Lines = []
    for i, n in (("i", "vec2({}, 0.0)"), ("j", "vec2(0.0, {})")):
        n = n.format(f"ti.select({i} <= WALL, 1.0, -1.0)")
        touch = pasted(law.contact, "touch", u="u", n=n, friction=number(law.friction))
        lines += [f"if {i} <= WALL or {i} >= GRID - WALL:"]
        lines += indented([*touch, *area], 4)
    return lines


def push_out(cast: Cast) -> Lines:
    """Particles that have got into solids leave them."""
    lines = pasted("solids", "push_still") if cast.still else []
    count = len(cast.rigid + cast.movers)
    code = pasted("solids", "push_moving")
    if count:
        one = [with_name(line, "k", "0") for line in code]
        loop = [f"for k in range({count}):", *indented(code, 4)]
        test = "if near[base + 1] < 2.0 * DX:  # thin and fast ones overtake particles"
        lines += [test, *indented(one if count == 1 else loop, 4)]
    if lines:
        lines += ["x[p] = clamp(x[p], 2.0 * DX, 1.0 - 2.0 * DX)"]
    return lines


def tick(cast: Cast) -> Lines:
    """What the time decides at the start of a step, and forces of meshes."""
    lines = ["time[None] = DT * (step + 1)"] if cast.timed_belts else []
    if len(cast.movers) == 1:
        lines += pasted("solids", "follow_one", first=str(len(cast.rigid)))
    elif cast.movers:
        lines += pasted("solids", "follow", first=str(len(cast.rigid)))
    return lines + (["apply_forces()"] if has_mesh(cast) else [])


def bodies(cast: Cast) -> Lines:
    """Rigid bodies."""
    return ["move_bodies()"] if cast.rigid else []


def substep(cast: Cast) -> Lines:
    """Call of a step."""
    return ["substep(step, motion(DT * (step + 1)))"]


def balls(cast: Cast) -> Lines:
    """Particles as balls, in one picture for each object."""
    if not cast.matter:
        return []
    one = len(cast.matter) == 1
    return pasted(
        "drawing", "ball", spot="balls[j, i]" if one else "balls[j, i, owner[p]]"
    )


def seen(cast: Cast) -> Lines:
    """Number of what is seen in a pixel."""
    count = len(cast.matter)
    kind = "covered_most" if count > 1 else "covered" if count else "none"
    lines = pasted("drawing", kind, count=str(count))
    moving = len(cast.rigid + cast.movers)
    if moving == 1:
        code = pasted("drawing", "mover", number=str(1 + count))
        lines += [with_name(line, "k", "0") for line in code]
    elif moving:
        lines += [f"for k in range({moving}):"]
        lines += indented(pasted("drawing", "mover", number=f"{1 + count} + k"), 4)
    return lines


def backdrop(cast: Cast) -> Lines:
    """The picture before anything is drawn."""
    if cast.still:
        return ["image = BACKDROP.copy()"]
    return ["image = np.zeros((PIXELS, PIXELS), np.uint8)"]
