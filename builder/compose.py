"""Parents: scenes composed of objects of two or three seeds, in a new layout.

How many objects and materials a scene has, and which, is drawn first, so that the
corpus has the statistics that the paper reports; objects are then taken to match.
"""

import copy
from collections.abc import Mapping
from typing import Final

import numpy as np

from mpmworlds.builder.modify import turn_gravity
from mpmworlds.builder.parts import (
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

OBJECTS: Final = {"1": 0.07, "2": 0.35, "3": 0.36, "4": 0.17, "5": 0.05}
KINDS_OF_MATTER: Final = {"1": 0.775, "2": 0.163, "3": 0.052, "4": 0.01}
MATERIALS: Final = {
    "liquid": 0.29,
    "elastic": 0.235,
    "snow": 0.14,
    "sand": 0.10,
    "viscoplastic": 0.09,
    "plastic": 0.04,
    "elastic_fem": 0.03,
    "viscoelastic": 0.03,
    "wet_sand": 0.03,
    "rigid": 0.02,
}
LAWS: Final = {"separate": 0.6, "slip": 0.2, "sticky": 0.2}
GREY: Final = "#969696"


def draw_counts(rng: np.random.Generator) -> tuple[int, int]:
    """How many objects a scene is to have, and of how many materials."""
    kinds = int(weighted(rng, KINDS_OF_MATTER))
    return max(int(weighted(rng, OBJECTS)), kinds), kinds


def compose(
    rng: np.random.Generator, seeds: Mapping[str, Data], count: int, kinds: int
) -> tuple[Data, Data]:
    """Compose a scene.

    Parameters
    ----------
    rng
        Source of all choices.
    seeds
        Plain data of the seeds to choose from, by name.
    count, kinds
        How many objects, and of how many materials.

    Returns
    -------
    dict, dict
        Plain data of the scene, not yet validated as a whole, and the record of what
        was taken from where.

    Raises
    ------
    NoRoomError
        If the objects that were drawn do not fit; draw again.
    """
    names = rng.permutation(sorted(seeds))[: 2 + int(rng.uniform() < 0.35)].tolist()
    scene = copy.deepcopy(seeds[names[0]])
    kept, taken = _choose(rng, [seeds[name] for name in names], count, kinds)
    scene["objects"] = []
    mirrored = bool(rng.integers(2))
    sources = [[names[source], number] for source, number, _ in kept + taken]
    staying = [copy.deepcopy(thing) for _, _, thing in kept]
    added = [copy.deepcopy(thing) for _, _, thing in taken]
    if mirrored:
        for thing in staying:
            mirror(thing)
    _vary(rng, staying, added)
    _give_materials(rng, staying + added, kinds)
    for thing in staying + added:
        thing["visualization"]["color"] = GREY
    for thing in staying + added:
        _recolor(rng, thing, staying + added)
    scene["objects"] = renamed(staying)
    numbers = range(len(staying), count)
    for number, thing in zip(numbers, added, strict=True):
        place(rng, scene, thing | {"name": f"object_{number}"})
    scene["environment"]["walls"]["contact"] = weighted(rng, LAWS)
    if rng.uniform() < 0.15:
        turn_gravity(rng, scene)
    scene["simulation"]["seed"] = int(rng.integers(2**31))
    record = {"operator": "compose", "objects": sources, "kept": len(staying)}
    givers = {source for source, _, _ in kept + taken} | {
        0
    }  # whose surroundings it has
    used = [name for source, name in enumerate(names) if source in givers]
    return scene, record | {"mirrored": mirrored, "seeds": used}


Pick = tuple[int, int, Data]  # number of the seed, number of the object, the object


def _choose(
    rng: np.random.Generator, scenes: list[Data], count: int, kinds: int
) -> tuple[list[Pick], list[Pick]]:
    """Objects that stay where they are in the first seed, and others to be placed.

    Those to be placed begin with matter, since a scene without any is not valid.
    """
    picks = [
        (n, i, thing)
        for n, s in enumerate(scenes)
        for i, thing in enumerate(s["objects"])
    ]
    first = [pick for pick in picks if pick[0] == 0]
    stay = int(rng.integers(1, count)) if count > 1 else 0
    kept = [first[i] for i in sorted(rng.permutation(len(first))[:stay].tolist())]
    matter = kinds + int(rng.binomial(count - kinds, 0.35))
    need = max(matter - sum(is_matter(thing) for _, _, thing in kept), 0)
    rest = [pick for pick in picks if count == 1 or pick[0] > 0]
    rest = [rest[i] for i in rng.permutation(len(rest)).tolist()]
    grains = [pick for pick in rest if is_matter(pick[2])]
    solids = [pick for pick in rest if not is_matter(pick[2])]
    left = count - len(kept)
    need = min(need, left)
    taken = grains[:need] + solids[: left - need]
    if len(kept) + len(taken) < count:
        raise NoRoomError("these seeds have too few objects of the kinds drawn")
    if sum(is_matter(thing) for _, _, thing in kept + taken) < kinds:
        raise NoRoomError("too few objects of matter for the materials drawn")
    return kept, taken


def _vary(rng: np.random.Generator, staying: list[Data], added: list[Data]) -> None:
    """Scale and set in motion, in place."""
    for thing in added:
        scale(thing, rounded(rng.uniform(0.6, 1.25), 2))
    chances = {
        "static_collider": 0.2,
        "kinematic_collider": 0.5,
        "dynamic_body": 0.4,
        "emitter": 0.5,
    }
    for thing in staying + added:
        if rng.uniform() < chances[thing["object_type"]]:
            set_in_motion(rng, thing)


def _give_materials(rng: np.random.Generator, things: list[Data], kinds: int) -> None:
    """Make the matter consist of so many materials, in place."""
    weights, chosen = dict(MATERIALS), []
    for _ in range(kinds):
        chosen.append(weighted(rng, weights))
        del weights[chosen[-1]]
    matter = [thing for thing in things if is_matter(thing)]
    order = rng.permutation(len(matter)).tolist()
    for n, i in enumerate(order):
        name = chosen[n] if n < kinds else str(rng.choice(chosen))
        if material_of(matter[i]) != name:
            give_material(rng, matter[i], name)


def _recolor(rng: np.random.Generator, thing: Data, things: list[Data]) -> None:
    """A colour of its own; still obstacles are grey half of the time."""
    if thing["object_type"] == "static_collider" and rng.integers(2):
        return
    thing["visualization"]["color"] = free_color(rng, things)
