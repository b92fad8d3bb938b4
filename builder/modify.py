"""Children: one structured edit of a scene.

An edit changes plain data in place and returns what it did. It raises `NoRoomError`
where it does not apply; then another is drawn.
"""

import copy
import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from mpmworlds.builder.parts import (
    MATERIALS,
    NOT_EMITTED,
    Data,
    NoRoomError,
    free_color,
    give_material,
    is_matter,
    material_of,
    mirror,
    renamed,
    rounded,
    scale,
    set_in_motion,
    weighted,
)
from mpmworlds.builder.place import place

ALL_AT_ONCE: Final = 0.75  # share of the swaps that change all objects of a material
SAME_MATERIAL: Final = 0.8  # share of added matter that takes a material of the scene
Edit = Callable[[np.random.Generator, Data, Sequence[Data]], Data]


def add_object(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Add an object of one of the seeds, scaled, mirrored or not, in a new place."""
    thing = copy.deepcopy(pool[int(rng.integers(len(pool)))])
    number = len(scene["objects"])
    scale(thing, rounded(rng.uniform(0.5, 1.1), 2))
    if rng.integers(2):
        mirror(thing)
    present = sorted({material_of(o) for o in scene["objects"] if is_matter(o)})
    if is_matter(thing) and rng.uniform() < SAME_MATERIAL:
        give_material(rng, thing, str(rng.choice(present)))
    thing["visualization"] = {"color": free_color(rng, scene["objects"])}
    place(rng, scene, thing | {"name": f"object_{number}"})
    record = {"object": f"object_{number}", "object_type": thing["object_type"]}
    if is_matter(thing):
        record["material"] = material_of(thing)
    return record | {"shape": thing["shape"]["type"]}


def remove_object(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Take one object away; a scene without matter is no valid draw."""
    i = int(rng.integers(len(scene["objects"])))
    gone = scene["objects"].pop(i)
    scene["objects"] = renamed(scene["objects"])
    return {"object": gone["name"], "object_type": gone["object_type"]}


def swap_material(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Give one object of matter, or all that share its material, another material."""
    things = [o for o in scene["objects"] if is_matter(o)]
    before = material_of(things[rng.integers(len(things))])
    same = [o for o in things if material_of(o) == before]
    if rng.uniform() >= ALL_AT_ONCE:
        same = [same[rng.integers(len(same))]]
    emitted = any(o["object_type"] == "emitter" for o in same)
    names = [m for m in sorted(MATERIALS) if m != before]
    names = [m for m in names if not (emitted and m in NOT_EMITTED)]
    weights = {m: 2.0 if m in ("liquid", "elastic") else 1.0 for m in names}
    after = weighted(rng, weights)
    for thing in same:
        give_material(rng, thing, after)
    return {"objects": [o["name"] for o in same], "from": before, "to": after}


def resize_object(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Make one object markedly larger or smaller."""
    thing = scene["objects"][rng.integers(len(scene["objects"]))]
    factor = rounded(rng.choice([rng.uniform(0.5, 0.75), rng.uniform(1.3, 1.7)]), 2)
    scale(thing, factor)
    return {"object": thing["name"], "factor": factor}


def reshape_object(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Give one body or obstacle another shape of about the same area."""
    things = [o for o in scene["objects"] if o["shape"]["type"] in AREAS]
    things = [o for o in things if o["object_type"] != "emitter"]
    if not things:
        raise NoRoomError("no object has a shape that can be exchanged")
    thing = things[rng.integers(len(things))]
    before = thing["shape"]
    names = [name for name in sorted(NEW_SHAPES) if name != before["type"]]
    after = str(rng.choice(names))
    r = math.sqrt(AREAS[before["type"]](before) / math.pi)
    shape = {"type": after, "center": before["center"]} | NEW_SHAPES[after](r)
    if after != "circle":
        shape["angle_deg"] = rounded(rng.uniform(-90.0, 90.0), 1)
    thing["shape"] = shape
    return {"object": thing["name"], "from": before["type"], "to": after}


def change_motion(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Give one collider, body or nozzle another motion."""
    thing = scene["objects"][rng.integers(len(scene["objects"]))]
    before = thing.get("kinematics", {"type": "none"})["type"]
    after = set_in_motion(rng, thing)
    return {"object": thing["name"], "from": before, "to": after}


def change_contact(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Change the contact law of the walls and of every collider but belts."""
    before = scene["environment"]["walls"]["contact"]
    laws = [law for law in ("sticky", "slip", "separate") if law != before]
    after = str(rng.choice(laws))
    scene["environment"]["walls"]["contact"] = after
    for thing in scene["objects"]:
        belt = thing.get("kinematics", {}).get("type") == "conveyor"
        if "contact" in thing and not belt:
            thing["contact"]["type"] = after
    return {"from": before, "to": after}


def change_emission(
    rng: np.random.Generator, scene: Data, pool: Sequence[Data]
) -> Data:
    """Make a nozzle release faster or slower, and at another time."""
    nozzles = [o for o in scene["objects"] if "emission" in o]
    if not nozzles:
        raise NoRoomError("no nozzle to change")
    thing = nozzles[rng.integers(len(nozzles))]
    emission = thing["emission"]
    factor = rounded(rng.choice([rng.uniform(0.5, 0.8), rng.uniform(1.25, 1.8)]), 2)
    emission["velocity"] = [rounded(v * factor) for v in emission["velocity"]]
    emission["rate"] = rounded(emission["rate"] * factor)
    delay = rounded(rng.uniform(0.0, 0.25), 3)
    emission["start"] = rounded(emission["start"] + delay, 3)
    emission["stop"] = rounded(emission["stop"] + delay, 3)
    return {"object": thing["name"], "factor": factor, "delay": delay}


def change_gravity(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Make gravity weaker and oblique."""
    before = scene["environment"]["gravity"]
    return {"from": before, "to": turn_gravity(rng, scene)}


def turn_gravity(rng: np.random.Generator, scene: Data) -> list[float]:
    """Make gravity weaker and oblique, in place; returns the new one [m/s^2]."""
    angle = np.radians(rng.uniform(-35.0, 35.0))
    strength = rng.uniform(3.0, 9.8)
    gravity = [rounded(strength * np.sin(angle)), rounded(-strength * np.cos(angle))]
    scene["environment"]["gravity"] = gravity
    return gravity


AREAS: Final[dict[str, Callable[[Data], float]]] = {
    "box": lambda s: s["size"][0] * s["size"][1],
    "rounded_box": lambda s: s["size"][0] * s["size"][1],
    "circle": lambda s: math.pi * s["radius"] ** 2,
    "ellipse": lambda s: math.pi * s["semi_axes"][0] * s["semi_axes"][1],
    "capsule": lambda s: s["length"] * 2.0 * s["radius"] + math.pi * s["radius"] ** 2,
}
NEW_SHAPES: Final[dict[str, Callable[[float], Data]]] = {
    "box": lambda r: {"size": [rounded(2.2 * r), rounded(1.4 * r)]},
    "circle": lambda r: {"radius": rounded(r)},
    "ellipse": lambda r: {"semi_axes": [rounded(1.4 * r), rounded(0.7 * r)]},
    "polygon": lambda r: {
        "vertices": [
            [rounded(1.4 * r * math.cos(a)), rounded(1.4 * r * math.sin(a))]
            for a in (math.radians(90.0 + 120.0 * k) for k in range(3))
        ]
    },
    "ring": lambda r: {"radius": rounded(1.2 * r), "thickness": rounded(0.42 * r)},
    "rounded_box": lambda r: {
        "size": [rounded(1.8 * r), rounded(1.8 * r)],
        "corner_radius": rounded(0.4 * r),
    },
}
EDITS: Final[dict[str, Edit]] = {
    "add_object": add_object,
    "change_contact": change_contact,
    "change_emission": change_emission,
    "change_gravity": change_gravity,
    "change_motion": change_motion,
    "remove_object": remove_object,
    "reshape_object": reshape_object,
    "resize_object": resize_object,
    "swap_material": swap_material,
}
SHARES: Final = {
    "add_object": 0.14,
    "change_contact": 0.08,
    "change_emission": 0.08,
    "change_gravity": 0.09,
    "change_motion": 0.16,
    "remove_object": 0.12,
    "reshape_object": 0.1,
    "resize_object": 0.09,
    "swap_material": 0.14,
}


def modify(rng: np.random.Generator, scene: Data, pool: Sequence[Data]) -> Data:
    """Apply one edit, drawn at random, in place; returns the record of the edit.

    Parameters
    ----------
    rng
        Source of all choices.
    scene
        Plain data of the scene.
    pool
        Objects that may be added.

    Raises
    ------
    NoRoomError
        If the edit does not apply to the scene; draw again.
    """
    name = weighted(rng, SHARES)
    return {"operator": name} | EDITS[name](rng, scene, pool)
