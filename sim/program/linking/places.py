"""Code for the hooks of the outline: what the features of a scene do at each place."""

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from mpmworlds.sim.program.features.material import Numbers
from mpmworlds.sim.program.linking import texts
from mpmworlds.sim.program.linking.cast import Cast, is_mesh, is_rigid
from mpmworlds.sim.program.linking.layout import WIDTH, indented, literal, number
from mpmworlds.sim.program.linking.source import Lines, body_of, library

Group = tuple[list[int], Lines]
FULL = ["full = ti.max(full, 1.0)"]


def pasted(module: str, name: str, **given: str) -> Lines:
    """Statements of a hook with texts in place of some of its parameters."""
    return body_of(library().hooks[module, name], given)


def places_of(cast: Cast) -> dict[str, Lines]:
    """What stands at each hook that the scene has something for."""
    places = {
        "place": place(cast),
        "bake": bake(cast),
        "launch": launch(cast),
        "paint": paint(cast),
        "throw": pasted("elastic_fem", "throw") if cast.is_moving else [],
        "share": pasted("outline", "share_area" if has_area(cast) else "share"),
        "note": of_all(cast, "note"),
        "fullness": pasted("outline", "fullness") if has_area(cast) else [],
        "enter": pasted(
            "outline", f"enter_{'fullness' if has_area(cast) else 'velocity'}"
        ),
        "unborn": pasted("outline", "unborn") if cast.nozzles else [],
        "unborn_yet": unborn_yet(cast) if cast.nozzles else [],
        "stress": by_owner(grouped(cast, "stress")),
        "scatter": matter_at(cast, "scatter"),
        "remember": of_all(cast, "remember"),
        "keep": keep(cast),
        "spread": spread(cast),
        "gather": of_all(cast, "gather") or pasted("outline", "gather"),
        "solids": solids(cast) if cast.matter else [],
        "walls": walls(cast),
        "inwards": pasted("contact", "inwards"),
        "settle": matter_at(cast, "settle"),
        "advance": advance(cast),
        "push_out": push_out(cast) if cast.matter else [],
        "tighten": tighten(cast),
        "accelerate": pasted("rigid", "fall_and_be_kicked" if cast.matter else "fall"),
        "rub": rub(cast) if cast.rigid else [],
        "tick": tick(cast),
        "bodies": bodies(cast),
        "balls": balls(cast),
        "seen": seen(cast),
        "show": pasted("drawing", "show_before" if cast.still else "show"),
        "start": start(cast),
        "substep": substep(cast),
        "backdrop": backdrop(cast),
        "skip": ["continue"],
    }
    summed = [n for n in fields_of(cast, "node") if library().fields[n].start]
    return places | {"clear": clear(summed)}


def clear(names: list[str]) -> Lines:
    """Loop that sets fields of nodes to 0."""
    if not names:
        return []
    loop = ["ti.loop_config(serialize=SERIAL)", "for i, j in ti.ndrange(GRID, GRID):"]
    return [*loop, *(f"    {name}[i, j] = 0.0" for name in names)]


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
    some = f"x[p], v[p] = {place}, {speed}" if cast.is_moving else f"x[p] = {place}"
    lines.append(some)  # other fields are 0 at first
    alike = [n for n in fields_of(cast, "particle") if not start_differs(cast, n)]
    starts = {name: start_of(cast, name) for name in alike}
    starts = {name: start for name, start in starts.items() if start != "0.0"}
    lines += assigned(starts)
    for name in fields_of(cast, "particle"):
        if start_differs(cast, name):
            lines += starts_of(cast, name)
    lines = [lines[0], *indented(lines[1:] + turning(cast), 4)]
    return lines + (pasted("elastic_fem", "weave") if has_mesh(cast) else [])


def assigned(starts: dict[str, str]) -> Lines:
    """Statements that give fields of particles their first values, as few as fit."""
    lines: Lines = []
    names: list[str] = []
    for name in starts:
        line = ", ".join(f"{n}[p]" for n in [*names, name])
        line += f" = {', '.join(starts[n] for n in [*names, name])}"
        if names and len(line) <= WIDTH - 8:
            names, lines[-1] = [*names, name], line
        else:
            names = [name]
            lines.append(f"{name}[p] = {starts[name]}")
    return lines


def unborn_yet(cast: Cast) -> Lines:
    """What is not born yet, and never if its place is taken."""
    room: Lines = []
    if cast.firm:
        here = "flow[at].z" if len(cast.firm) == len(cast.matter) else "firm[at]"
        room += pasted("outline", "beside", here=here)
    count = len(cast.rigid + cast.movers)
    if count:
        covered = "covered" if count == 1 else "covered_any"
        room += pasted("outline", covered, count=str(count))
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
    solids = where(cast, "0.0"), "np.float32(THINGS)", "RIMS", "BACKDROP"
    given = "START", "BIRTH", "TRIANGLES", "BAKED", *solids
    return [f"place({', '.join(given)})"]


def fields_of(cast: Cast, per: str) -> list[str]:
    """Names of the fields of materials over particles or nodes, in order of use."""
    code = [
        line
        for at in ("stress", "scatter", "settle", "remember")
        for _, lines in grouped(cast, at)
        for line in lines
    ]
    code.append("spread[p]")  # for drawing
    known = [name for name, field in library().fields.items() if field.per == per]
    return [name for name in known if any(f"{name}[" in line for line in code)]


def has_mesh(cast: Cast) -> bool:
    """Whether a body is a mesh."""
    return any(map(is_mesh, cast.matter))


def several(cast: Cast) -> bool:
    """Whether particles must know which object they belong to."""
    return len(cast.matter) > 1


def of_all(cast: Cast, at: str) -> Lines:
    """What all particles or nodes do at a place if one material needs it."""
    return next((code for _, code in grouped(cast, at) if code), [])


def keep(cast: Cast) -> Lines:
    """What particles keep of velocities that the grid cannot hold."""
    lines = matter_at(cast, "keep")
    some = any(not code for _, code in grouped(cast, "keep"))
    return ["fine = vec2(0.0)", *lines] if lines and some else lines


def spread(cast: Cast) -> Lines:
    """How thin matter is spread, for drawing."""
    return pasted("outline", f"spread_by_{'area' if has_area(cast) else 'mass'}")


def by_owner(groups: list[Group]) -> Lines:
    """Code of the group that a particle belongs to."""
    if len(groups) <= 1:
        return groups[0][1] if groups else []
    lines: Lines = []
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


@lru_cache(64)
def grouped(cast: Cast, at: str) -> list[Group]:
    """Numbers of the objects of matter that do the same at a place, and what.

    It is asked for about fifty times a program, so it is kept; not to be changed.
    """
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


def is_one_of(numbers: Sequence[int], name: str = "owner[p]") -> str:
    """Text of the test that a name, by default a particle's owner, is a number."""
    return " or ".join(f"{name} == {k}" for k in numbers)


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
    lines += ["nearest = vec3(0.0, 0.0, 1.0)"]
    lines += [f"for k in range({len(moving)}):"]
    lines += indented(pasted("solids", "see"), 4)
    for i, (code, numbers) in enumerate(groups.items()):
        test, *rest = code
        if len(groups) > 1:
            test = with_number(test, "k", numbers)
        lines += indented([f"{'el' if i else ''}{test}", *rest], 4)
    return [*lines, "near[i, j] = nearest"]


def with_number(test: str, name: str, numbers: list[int]) -> str:
    """An `if` that also asks whether a name is one of some numbers."""
    which = is_one_of(numbers, name)
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
    name = meeting(thing) if cast.solids == [thing] else "meet_moving"
    code = pasted("solids", name, skin=number(touched.skin_cells))
    return at_hook(code, "contact", touch)


def meeting(thing: Any) -> str:
    """Name of the hook for contact with the only solid that moves, by how it moves."""
    shifts, turns = (True, True) if is_rigid(thing) else texts.moves(thing)
    if not turns:
        return "meet_shifting"
    return "meet_moving" if shifts else "meet_turning"


def contact(cast: Cast, name: str, touched: Any, **given: str) -> Lines:
    """Statements of a contact law; space is full where matter touches something."""
    law = getattr(touched, "type", "separate")
    lines = pasted(law, name, friction=number(touched.friction), **given)
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
    groups = [group for group in grouped(cast, "tighten") if group[1]]
    return ["P = mat2(0.0)"] * (len(groups) > 1) + by_owner(groups)


def rub(cast: Cast) -> Lines:
    """Friction of rigid bodies on solids, and on belts with their speeds."""
    belts: Lines = []
    for k, thing in enumerate(cast.solids):
        if getattr(thing, "kinematics", None) and thing.kinematics.type == "conveyor":
            belts += [f"if o == {k}:", f"    belt = {belt(thing)}"]
    code = pasted("rigid", "rub", belt="belt" if belts else "0.0")
    return ["belt = 0.0", *belts, *code] if belts else code


def walls(cast: Cast) -> Lines:
    """Contact of the grid with the four walls."""
    if not cast.matter:
        return []
    law = cast.scene.environment.walls
    given = {"friction": number(law.friction)}
    code = at_hook(
        pasted("outline", "bounded"), "touch", pasted(law.contact, "bound", **given)
    )
    return [*code, *indented(FULL * has_area(cast), 4)]


def advance(cast: Cast) -> Lines:
    """Places of particles, within the grid where it is looked up by them."""
    if cast.rigid + cast.movers and not cast.still:
        return ["x[p] += DT * g.xy"]
    return pasted("outline", "advance")


def push_out(cast: Cast) -> Lines:
    """Particles that have got into solids leave them."""
    lines = pasted("solids", "push_still") if cast.still else []
    lines += pasted("solids", "push_moving") if cast.rigid + cast.movers else []
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


def where(cast: Cast, time: str) -> str:
    """Text of the array of where movers are at a time."""
    place = f"motion({time})"
    return f"np.float32({place})" if len(cast.movers) == 1 else place


def substep(cast: Cast) -> Lines:
    """Call of a step."""
    return [f"substep(step, {where(cast, 'DT * (step + 1)')})"]


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
    return ["image = np.zeros((PIXELS, PIXELS), np.int32)"]
