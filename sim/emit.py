"""The parts of a program that depend on its scene, as text formatted like the rest.

Each function returns the lines of one region of the skeleton.
"""

from collections.abc import Iterable
from typing import Any

from mpmworlds.sim.materials import MATERIALS
from mpmworlds.sim.objects import MOTIONS
from mpmworlds.sim.scene import Scene
from mpmworlds.sim.shapes import SHAPES

WIDTH = 88
SECTIONS = ("simulation", "environment", "objects", "output")


def literal(value: Any, indent: int = 0, before: int = 0, after: int = 0) -> str:
    """Python text of plain data, laid out as the formatter would.

    Mappings become `dict(key=value)` calls. `before` and `after` count the characters
    around the text on its first and last line.
    """
    flat = _flat(value)
    fits = indent + before + len(flat) + after <= WIDTH
    if fits or not isinstance(value, dict | list):
        return flat
    opening, closing = ("dict(", ")") if isinstance(value, dict) else ("[", "]")
    space = " " * (indent + 4)
    inner = flat[len(opening) : -1]
    if isinstance(value, dict) and len(space + inner) <= WIDTH:
        return f"{opening}\n{space}{inner}\n{' ' * indent}{closing}"
    pairs = value.items() if isinstance(value, dict) else [("", v) for v in value]
    heads = [(f"{key}=" if key else "", item) for key, item in pairs]
    lines = [
        space + head + literal(item, indent + 4, len(head), 1) for head, item in heads
    ]
    return f"{opening}\n{''.join(f'{line},{chr(10)}' for line in lines)}" + (
        f"{' ' * indent}{closing}"
    )


def _flat(value: Any) -> str:
    if isinstance(value, dict):
        return "dict(" + ", ".join(f"{k}={_flat(v)}" for k, v in value.items()) + ")"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flat, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def emit_scene(scene: Scene) -> str:
    """The scene as named constants, one for each section of the file."""
    data = scene.to_data()
    return "".join(
        f"{name.upper()} = {literal(data[name], 0, len(name) + 3)}\n"
        for name in SECTIONS
    )


def emit_shapes(scene: Scene) -> str:
    """The signed distance of the shapes that occur."""
    kinds = sorted({thing.shape.type for thing in scene.objects})
    branches = [(kind, [f"s = {SHAPES[kind].DISTANCE}"]) for kind in kinds]
    return (
        "@ti.func\ndef distance(shape: ti.template(), p):\n"
        '    """Signed distance [m] and normal of a shape at p, in its own frame."""\n'
        + _choose('shape["type"]', ["s = vec3(0.0)"], branches)
        + f"    return s\n\n\n{_reach(kinds)}"
    )


def _reach(kinds: list[str]) -> str:
    """The radius of the circle around each shape that occurs."""
    tests = "".join(
        f'    if shape["type"] == "{kind}":\n        return {SHAPES[kind].REACH}\n'
        for kind in kinds[:-1]
    )
    return (
        "def reach(shape):\n"
        '    """Radius [m] of the circle around its center that holds a shape."""\n'
        f"{tests}    return {SHAPES[kinds[-1]].REACH}\n"
    )


def emit_motion(scene: Scene) -> str:
    """The motions of colliders that occur."""
    kinds = sorted(
        {
            thing.kinematics.type
            for thing in scene.objects
            if thing.object_type == "kinematic_collider"
        }
    )
    branches = [(kind, [f"moved, rate = {MOTIONS[kind].MOVE}"]) for kind in kinds]
    return (
        "@ti.func\ndef move(k: ti.template(), motion: ti.template(), t):\n"
        '    """Put collider k where its motion has it at time t [s]."""\n'
        + _choose('motion["type"]', ["moved, rate = vec3(0.0), vec3(0.0)"], branches)
        + "    now, twist[k] = vec3(HOME[k]) + moved, rate\n"
        "    pose[k] = vec4(now.xy, ti.cos(now.z), ti.sin(now.z))\n"
    )


def emit_materials(scene: Scene) -> str:
    """The stress of the materials that occur."""
    models = sorted(materials_of(scene))
    branches = [(name, MATERIALS[name].STRESS.splitlines()) for name in models]
    return (
        "@ti.func\ndef stress(p, m: ti.template()):\n"
        '    """Strain particle p of material m for a step; Kirchhoff stress [Pa]."""\n'
        "    t, z = 0.0, vec2(0.0)\n"
        + _choose('m["constitutive_model"]', [], branches)
        + "    return t, z\n"
    )


def materials_of(scene: Scene) -> set[str]:
    """Names of the constitutive models in a scene."""
    return {
        thing.physics_properties.constitutive_model
        for thing in scene.objects
        if thing.object_type in ("dynamic_body", "emitter")
    }


def _choose(
    key: str, start: Iterable[str], branches: list[tuple[str, list[str]]]
) -> str:
    """Lines of an if chain over the values of a compile-time key; one needs no test."""
    if len(branches) == 1:
        return "".join(f"    {line}\n" for line in branches[0][1])
    text = "".join(f"    {line}\n" for line in start)
    for i, (value, lines) in enumerate(branches):
        word = "elif" if i else "if"
        text += f'    {word} ti.static({key} == "{value}"):\n'
        text += "".join(f"        {line}\n" for line in lines)
    return text
