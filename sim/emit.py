"""The parts of a program that depend on its scene, as text formatted like the rest.

Each function returns the lines of one region of the skeleton.
"""

from typing import Any

from mpmworlds.sim.materials import MATERIALS
from mpmworlds.sim.motions import MOTIONS
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.shapes import SHAPES

WIDTH = 88
STATIC_TEST = 'ti.static({}["{}"] == "{}")'
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
    return "\n".join([opening, *(f"{line}," for line in lines), " " * indent + closing])


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
    """The measures and the signed distance of the shapes that occur."""
    kinds = sorted({thing.shape.type for thing in scene.objects})
    numbers = {kind: i for i, kind in enumerate(kinds)}
    returns = [
        [f"reach = {SHAPES[k].REACH}", f"return [{SHAPES[k].MEASURES}, reach]"]
        for k in kinds
    ]
    tests = "".join(
        f'    if shape["type"] == "{kind}":\n        {lines[0]}\n        {lines[1]}\n'
        for kind, lines in zip(kinds[:-1], returns[:-1], strict=True)
    )
    branches = [
        (f"kind[k] == {i}", [f"s = {SHAPES[kind].DISTANCE}"])
        for kind, i in numbers.items()
    ]
    return (
        f"KINDS = {literal(numbers, 0, 8)}\n\n\n"
        "def measures(shape):\n"
        '    """Numbers of a shape for its distance, and the radius around it [m]."""\n'
        f"{tests}    {returns[-1][0]}\n    {returns[-1][1]}\n\n\n"
        "@ti.func\ndef distance(k, p):\n"
        '    """Signed distance [m] and normal of object k at p, in its own frame."""\n'
        "    m = measure[k]\n" + _choose(["s = vec3(0.0)"], branches) + "    return s\n"
    )


def emit_motion(scene: Scene) -> str:
    """The motions of colliders that occur."""
    kinds = sorted(motions_of(scene))
    branches = [
        (
            STATIC_TEST.format("motion", "type", kind),
            [f"moved, rate = {MOTIONS[kind].MOVE}"],
        )
        for kind in kinds
    ]
    return (
        "@ti.func\ndef move(k: ti.template(), motion: ti.template(), t):\n"
        '    """Put collider k where its motion has it at time t [s]."""\n'
        + _choose(["moved, rate = vec3(0.0), vec4(0.0)"], branches)
        + "    now, twist[k] = vec3(HOME[k]) + moved, rate\n"
        "    pose[k] = vec4(now.xy, ti.cos(now.z), ti.sin(now.z))\n"
    )


def emit_emission(scene: Scene) -> str:
    """The kinds of emission that occur, each with its function of the library."""
    kinds = sorted(
        {
            thing.emission.type
            for thing in scene.objects
            if thing.object_type == "emitter"
        }
    )
    return f"EMIT = dict({', '.join(f'{kind}={kind}' for kind in kinds)})\n"


def emit_materials(scene: Scene) -> str:
    """The stress of the materials that occur."""
    models = sorted(materials_of(scene) - {"rigid"})
    branches = [
        (
            STATIC_TEST.format("m", "constitutive_model", name),
            MATERIALS[name].STRESS.splitlines(),
        )
        for name in models
    ]
    return (
        "@ti.func\ndef stress(p, m: ti.template()):\n"
        '    """Strain particle p of material m for a step; Kirchhoff stress [Pa]."""\n'
        "    t, z = 0.0, vec2(0.0)\n" + _choose([], branches) + "    return t, z\n"
    )


def materials_of(scene: Scene) -> set[str]:
    """Names of the constitutive models in a scene."""
    return {
        thing.physics_properties.constitutive_model
        for thing in scene.objects
        if thing.object_type in ("dynamic_body", "emitter")
    }


def motions_of(scene: Scene) -> set[str]:
    """Kinds of motion in a scene."""
    return {
        thing.kinematics.type
        for thing in scene.objects
        if thing.object_type == "kinematic_collider"
    }


def _choose(start: list[str], branches: list[tuple[str, list[str]]]) -> str:
    """Lines of an if chain of tests; a single branch needs no test."""
    if len(branches) == 1:
        return "".join(f"    {line}\n" for line in branches[0][1])
    text = "".join(f"    {line}\n" for line in start)
    for i, (test, lines) in enumerate(branches):
        text += f"    {'elif' if i else 'if'} {test}:\n"
        text += "".join(f"        {line}\n" for line in lines)
    return text
