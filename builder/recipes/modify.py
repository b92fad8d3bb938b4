"""Children: one structured edit of a scene.

An edit changes plain data in place and returns what it did. It raises `NoRoomError`
where it does not apply; then another is drawn.
"""

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from mpmworlds.builder.recipes.colors import free_color
from mpmworlds.builder.recipes.materials import give_material, may_consist_of
from mpmworlds.builder.recipes.motions import set_in_motion
from mpmworlds.builder.recipes.objects import (
    Data,
    NoRoomError,
    is_matter,
    material_of,
    renamed,
    rounded,
    weighted,
)
from mpmworlds.builder.recipes.place import place
from mpmworlds.builder.recipes.quantities import (
    mirror,
    quantities,
    scale,
    shape_of,
)
from mpmworlds.builder.recipes.tables import Tables
from mpmworlds.sim.program.features.shape import Turned
from mpmworlds.sim.scene.objects import SHAPES

ALL_AT_ONCE: Final = 0.75  # share of the swaps that change all objects of a material
SAME_MATERIAL: Final = 0.8  # share of added matter that takes a material of the scene


@dataclass(frozen=True)
class Means:
    """What an edit has to draw from: chance, tables, and objects that may be added."""

    rng: np.random.Generator
    tables: Tables
    pool: Sequence[Data]

    def one_of(self, things: Sequence[Any]) -> Any:
        """One of several things, each as likely as another."""
        return things[int(self.rng.integers(len(things)))]


Edit = Callable[[Means, Data], Data]


def add_object(means: Means, scene: Data) -> Data:
    """Add an object of one of the seeds, scaled, mirrored or not, in a new place."""
    rng, thing = means.rng, copy.deepcopy(means.one_of(means.pool))
    number = len(scene["objects"])
    scale(thing, rounded(rng.uniform(0.5, 1.1), 2))
    if rng.integers(2):
        mirror(thing)
    present = sorted({material_of(o) for o in scene["objects"] if is_matter(o)})
    if is_matter(thing) and rng.uniform() < SAME_MATERIAL:
        give_material(rng, means.tables, thing, means.one_of(present))
    thing["visualization"] = {"color": free_color(rng, scene["objects"])}
    place(rng, scene, thing | {"name": f"object_{number}"})
    record = {"object": f"object_{number}", "object_type": thing["object_type"]}
    if is_matter(thing):
        record["material"] = material_of(thing)
    return record | {"shape": thing["shape"]["type"]}


def remove_object(means: Means, scene: Data) -> Data:
    """Take one object away; a scene without matter is no valid draw."""
    i = int(means.rng.integers(len(scene["objects"])))
    gone = scene["objects"].pop(i)
    scene["objects"] = renamed(scene["objects"])
    return {"object": gone["name"], "object_type": gone["object_type"]}


def swap_material(means: Means, scene: Data) -> Data:
    """Give one object of matter, or all that share its material, another material."""
    before = material_of(means.one_of([o for o in scene["objects"] if is_matter(o)]))
    same = [o for o in scene["objects"] if is_matter(o) and material_of(o) == before]
    if means.rng.uniform() >= ALL_AT_ONCE:
        same = [means.one_of(same)]
    shares = {
        name: share
        for name, share in means.tables.materials.items()
        if name != before and all(may_consist_of(o, name) for o in same)
    }
    after = weighted(means.rng, shares)
    for thing in same:
        give_material(means.rng, means.tables, thing, after)
    return {"objects": [o["name"] for o in same], "from": before, "to": after}


def resize_object(means: Means, scene: Data) -> Data:
    """Make one object markedly larger or smaller."""
    rng, thing = means.rng, means.one_of(scene["objects"])
    factor = rounded(rng.choice([rng.uniform(0.5, 0.75), rng.uniform(1.3, 1.7)]), 2)
    scale(thing, factor)
    return {"object": thing["name"], "factor": factor}


def reshape_object(means: Means, scene: Data) -> Data:
    """Give one body or obstacle another shape of about the same area."""
    tables = means.tables
    things = [o for o in scene["objects"] if o["shape"]["type"] in tables.reshaped]
    things = [o for o in things if o["object_type"] != "emitter"]
    if not things:
        raise NoRoomError("no object has a shape that can be exchanged")
    thing = means.one_of(things)
    before = thing["shape"]
    after = means.one_of([n for n in tables.new_shapes if n != before["type"]])
    area, *_ = shape_of(before).moments()
    numbers = copy.deepcopy(tables.new_shapes[after])
    thing["shape"] = {"type": after, "center": before["center"]} | numbers
    for quantity in quantities(thing):
        if quantity.part is thing["shape"] and quantity.key in numbers:
            quantity.change(lambda x: rounded(x * math.sqrt(area / math.pi)))
    if issubclass(SHAPES[after], Turned):
        thing["shape"]["angle_deg"] = rounded(means.rng.uniform(-90.0, 90.0), 1)
    return {"object": thing["name"], "from": before["type"], "to": after}


def change_motion(means: Means, scene: Data) -> Data:
    """Give one collider, body or nozzle another motion."""
    thing = means.one_of(scene["objects"])
    before = thing.get("kinematics", {"type": "none"})["type"]
    after = set_in_motion(means.rng, means.tables, thing)
    return {"object": thing["name"], "from": before, "to": after}


def change_contact(means: Means, scene: Data) -> Data:
    """Change the contact law of the walls and of every collider but belts."""
    before = scene["environment"]["walls"]["contact"]
    after = means.one_of([law for law in means.tables.contacts if law != before])
    scene["environment"]["walls"]["contact"] = after
    for thing in scene["objects"]:
        belt = thing.get("kinematics", {}).get("type") == "conveyor"
        if "contact" in thing and not belt:
            thing["contact"]["type"] = after
    return {"from": before, "to": after}


def change_emission(means: Means, scene: Data) -> Data:
    """Make a nozzle release faster or slower, and at another time."""
    nozzles = [o for o in scene["objects"] if "emission" in o]
    if not nozzles:
        raise NoRoomError("no nozzle to change")
    rng, thing = means.rng, means.one_of(nozzles)
    emission = thing["emission"]
    factor = rounded(rng.choice([rng.uniform(0.5, 0.8), rng.uniform(1.25, 1.8)]), 2)
    emission["velocity"] = [rounded(v * factor) for v in emission["velocity"]]
    emission["rate"] = rounded(emission["rate"] * factor)
    delay = rounded(rng.uniform(0.0, 0.25), 3)
    emission["start"] = rounded(emission["start"] + delay, 3)
    emission["stop"] = rounded(emission["stop"] + delay, 3)
    return {"object": thing["name"], "factor": factor, "delay": delay}


def change_gravity(means: Means, scene: Data) -> Data:
    """Make gravity weaker and oblique."""
    before = scene["environment"]["gravity"]
    return {"from": before, "to": turn_gravity(means.rng, scene)}


def turn_gravity(rng: np.random.Generator, scene: Data) -> list[float]:
    """Make gravity weaker and oblique, in place; returns the new one [m/s^2]."""
    angle = np.radians(rng.uniform(-35.0, 35.0))
    strength = rng.uniform(3.0, 9.8)
    gravity = [rounded(strength * np.sin(angle)), rounded(-strength * np.cos(angle))]
    scene["environment"]["gravity"] = gravity
    return gravity


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


def modify(
    rng: np.random.Generator, tables: Tables, scene: Data, pool: Sequence[Data]
) -> Data:
    """Apply one edit, drawn at random, in place; returns the record of the edit.

    Parameters
    ----------
    rng
        Source of all choices.
    tables
        What it draws from.
    scene
        Plain data of the scene.
    pool
        Objects that may be added.

    Raises
    ------
    NoRoomError
        If the edit does not apply to the scene; draw again.
    """
    name = weighted(rng, tables.edits)
    return {"operator": name} | EDITS[name](Means(rng, tables, pool), scene)
