"""Texts of objects: their shapes, places, births and motions, with their numbers."""

import ast
import re
from collections import Counter
from typing import Any

from mpmworlds.sim.program.linking.cast import Cast, is_mesh, is_rigid, weights_of
from mpmworlds.sim.program.linking.layout import items, literal, number, offset
from mpmworlds.sim.program.linking.source import (
    Lines,
    body_of,
    library,
    names_read,
    parsed,
    result_of,
)
from mpmworlds.sim.scene.checks import jet_width
from mpmworlds.sim.scene.scene import Scene

COUNTED = {
    "dynamic_body": ("body", "bodies"),
    "emitter": ("nozzle", "nozzles"),
    "static_collider": ("obstacle", "obstacles"),
    "kinematic_collider": ("moving obstacle", "moving obstacles"),
}
WORDS = [
    "no",
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
]


def sentence(scene: Scene) -> str:
    """One sentence on a scene, which names no material."""
    counts = Counter[str](thing.object_type for thing in scene.objects)
    parts = [
        f"{WORDS[n] if n < len(WORDS) else n} {names[n > 1]}"
        for kind, names in COUNTED.items()
        if (n := counts[kind])
    ]
    text = " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))
    return f"{text[0].upper()}{text[1:]}."


def arguments(values: Any) -> str:
    """Text of arguments that follow others."""
    return "".join(f", {literal(value)}" for value in values)


def distance(shape: Any, x: str, y: str) -> str:
    """Signed distance of the points of arrays x, y from a shape."""
    star = "*" if getattr(shape, "angle_deg", 0.0) else ""
    place = f"{star}{in_frame(shape, x, y)}"
    return f"{shape.type}({place}{arguments(shape.numbers())})"


def in_frame(shape: Any, x: str, y: str) -> str:
    """Points of arrays x, y in the frame of a shape."""
    place = f"{offset(x, shape.center[0])}, {offset(y, shape.center[1])}"
    angle = getattr(shape, "angle_deg", 0.0)
    return f"turned({place}, {number(angle)})" if angle else place


def inlined(shape: Any) -> Lines:
    """Statements that find the signed distance of points from a shape."""
    piece = library().functions[shape.type]
    given = dict(zip(piece.parameters[2:], shape.numbers(), strict=True))
    lists = {name: value for name, value in given.items() if isinstance(value, list)}
    texts = {name: literal(v) for name, v in given.items() if name not in lists}
    return [
        f"x, y = {in_frame(shape, 'x', 'y')}",
        *(f"{name} = {literal(value)}" for name, value in lists.items()),
        *body_of(piece, texts),
        f"return {result_of(piece, texts)}",
    ]


def can_stand_inline(shape: Any) -> bool:
    """Whether the code of the distance of a shape may take point q for its point p.

    Not if it takes lists, nor if it has a q of its own beside p.
    """
    if any(isinstance(value, list) for value in shape.numbers()):
        return False
    *statements, last = parsed(library().functions[f"sd_{shape.type}"]).body
    taken = False
    for statement in [*statements, last]:
        names = [n for n in ast.walk(statement) if isinstance(n, ast.Name)]
        if taken and any(n.id == "p" for n in names):
            return False
        taken = taken or any(
            n.id == "q" and isinstance(n.ctx, ast.Store) for n in names
        )
    return True


def inlined_frame(shape: Any) -> Lines:
    """Statements that find signed distance and normal s of point q in its frame."""
    piece = library().functions[f"sd_{shape.type}"]
    given = dict(zip(piece.parameters[1:], map(literal, shape.numbers()), strict=True))
    given["p"] = "q"
    return [*body_of(piece, given), f"s = {result_of(piece, given)}"]


def in_own_frame(shape: Any) -> str:
    """Signed distance and normal of point q in the frame of a shape."""
    return f"sd_{shape.type}(q{arguments(shape.numbers())})"


def given(cast: Cast, thing: Any) -> dict[str, str]:
    """Number, density, signed distance and velocity of a body."""
    shape, density = thing.shape, number(thing.physics_properties.density)
    mesh = f"lambda x, y: {distance(shape, 'x', 'y')}"
    far = mesh if is_mesh(thing) else distance(shape, "X", "Y")
    k, (u, v) = str(cast.matter.index(thing)), map(number, thing.initial_state.velocity)
    return {"k": k, "density": density, "distance": far, "u": u, "v": v}


def body(cast: Cast, thing: Any) -> str:
    """Arguments of the function that fills or triangulates a body."""
    *rows, u, v = given(cast, thing).values()
    return ", ".join([*rows, u, v] if any(thing.initial_state.velocity) else rows)


def nozzle(cast: Cast, thing: Any) -> dict[str, str]:
    """Number, density and place of a nozzle, and its births."""
    emission, density = thing.emission, number(thing.physics_properties.density)
    width = float(f"{jet_width(thing):.6g}")
    births = f"{number(width)}, SPACING{arguments(emission.numbers())}"
    k, (x, y) = str(cast.matter.index(thing)), map(number, thing.shape.center)
    given = {"k": k, "density": density, "x": x, "y": y}
    return given | {"births": f"{emission.type}({births})"}


def line(shape: Any) -> str:
    """Polyline of a shape, as it is if it is the same for all shapes of the kind."""
    name = f"{shape.type}_line"
    piece = library().functions[name]
    same = result_of(piece, {})
    if not names_read(same):
        return same
    return f"{name}({arguments(shape.numbers())[2:]})"


def thing(solid: Any) -> str:
    """Row of a solid: of a rigid body, or of what moves on its own or never."""
    numbers = [*solid.shape.center, getattr(solid.shape, "angle_deg", 0.0)]
    if is_rigid(solid):
        material, state = solid.physics_properties, solid.initial_state
        numbers += [material.friction, material.restitution, *weights_of(solid)]
        rate = *state.velocity, state.angular_velocity
        numbers += rate if any(rate) else ()
    else:
        numbers.append(solid.contact.friction)
    return f"thing({', '.join(map(number, numbers))})"


def moves(thing: Any) -> tuple[bool, bool]:
    """Whether a mover ever shifts, and whether it ever turns."""
    *_, u, v, spin = items(row(thing)[1])
    return {u, v} != {"0.0"}, spin != "0.0"


def row(thing: Any) -> tuple[Lines, str]:
    """Row of a mover at time t, and the statements before it."""
    name, numbers = thing.kinematics.row()
    hook = library().hooks[thing.kinematics.type, name]
    x, y = thing.shape.center
    angle = getattr(thing.shape, "angle_deg", 0.0)
    given = {"x": x, "y": y, "degrees": angle} | numbers
    texts = {key: number(value) for key, value in given.items()}
    return [*map(tidied, body_of(hook, texts))], tidied(result_of(hook, texts))


def tidied(text: str) -> str:
    """Text of a sum of products without those that are 0."""
    text = text.replace("*unit(np.radians(0.0))", "1.0, 0.0")
    text = text.replace("sin - unit(np.radians(0.0))[1]", "sin")
    for zero in ("np.radians(0.0) + ", " + np.radians(0.0)"):
        text = text.replace(zero, "")
    text = text.replace("radians(0.0 + ", "radians(").replace(") - 0.0, ", "), ")
    text = re.sub(r" \+ 0\.0 \* \w+", "", text)
    return re.sub(r"\b0\.0 \* \w+", "0.0", text).replace("+ -", "- ")
