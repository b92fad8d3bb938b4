"""Parents: scenes composed of objects of two or three seeds, in a new layout.

How many objects and materials a scene has, and which, is drawn first, so that the
corpus has the statistics that the paper reports; objects are then taken to match.
"""

import copy
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from mpmworlds.builder.recipes.colors import GREY, free_color
from mpmworlds.builder.recipes.materials import give_material
from mpmworlds.builder.recipes.modify import turn_gravity
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
from mpmworlds.builder.recipes.quantities import mirror, scale
from mpmworlds.builder.recipes.tables import Tables


def draw_counts(rng: np.random.Generator, tables: Tables) -> tuple[int, int]:
    """How many objects a scene is to have, and of how many materials."""
    kinds = int(weighted(rng, tables.materials_per_scene))
    return max(int(weighted(rng, tables.objects)), kinds), kinds


def compose(
    rng: np.random.Generator,
    tables: Tables,
    seeds: Mapping[str, Data],
    count: int,
    kinds: int,
) -> tuple[Data, Data]:
    """Compose a scene.

    Parameters
    ----------
    rng
        Source of all choices.
    tables
        What it draws from.
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
    sources = [[names[pick.source], pick.number] for pick in kept + taken]
    staying = [copy.deepcopy(pick.thing) for pick in kept]
    added = [copy.deepcopy(pick.thing) for pick in taken]
    if mirrored:
        for thing in staying:
            mirror(thing)
    _vary(rng, tables, staying, added)
    _give_materials(rng, tables, staying + added, kinds)
    for thing in staying + added:
        thing["visualization"]["color"] = GREY
    for thing in staying + added:
        _recolor(rng, thing, staying + added)
    scene["objects"] = renamed(staying)
    numbers = range(len(staying), count)
    for number, thing in zip(numbers, added, strict=True):
        place(rng, scene, thing | {"name": f"object_{number}"})
    scene["environment"]["walls"]["contact"] = weighted(rng, tables.contacts)
    if rng.uniform() < 0.15:
        turn_gravity(rng, scene)
    scene["simulation"]["seed"] = int(rng.integers(2**31))
    record = {"operator": "compose", "objects": sources, "kept": len(staying)}
    givers = {0} | {pick.source for pick in kept + taken}  # 0: of the surroundings
    used = [name for source, name in enumerate(names) if source in givers]
    return scene, record | {"mirrored": mirrored, "seeds": used}


class Pick(NamedTuple):
    """An object that is taken, the number of its seed, and its number in that."""

    source: int
    number: int
    thing: Data


def _choose(
    rng: np.random.Generator, scenes: list[Data], count: int, kinds: int
) -> tuple[list[Pick], list[Pick]]:
    """Objects that stay where they are in the first seed, and others to be placed.

    Those to be placed begin with matter, since a scene without any is not valid.
    """
    picks = [
        Pick(n, i, thing)
        for n, s in enumerate(scenes)
        for i, thing in enumerate(s["objects"])
    ]
    first = [pick for pick in picks if pick.source == 0]
    stay = int(rng.integers(1, count)) if count > 1 else 0
    kept = [first[i] for i in sorted(rng.permutation(len(first))[:stay].tolist())]
    matter = kinds + int(rng.binomial(count - kinds, 0.35))
    need = max(matter - sum(is_matter(pick.thing) for pick in kept), 0)
    rest = [pick for pick in picks if count == 1 or pick.source > 0]
    rest = [rest[i] for i in rng.permutation(len(rest)).tolist()]
    grains = [pick for pick in rest if is_matter(pick.thing)]
    solids = [pick for pick in rest if not is_matter(pick.thing)]
    left = count - len(kept)
    need = min(need, left)
    taken = grains[:need] + solids[: left - need]
    if len(kept) + len(taken) < count:
        raise NoRoomError("these seeds have too few objects of the kinds drawn")
    if sum(is_matter(pick.thing) for pick in kept + taken) < kinds:
        raise NoRoomError("too few objects of matter for the materials drawn")
    return kept, taken


def _vary(
    rng: np.random.Generator, tables: Tables, staying: list[Data], added: list[Data]
) -> None:
    """Scale and set in motion, in place."""
    for thing in added:
        scale(thing, rounded(rng.uniform(0.6, 1.25), 2))
    for thing in staying + added:
        if rng.uniform() < tables.set_in_motion[thing["object_type"]]:
            set_in_motion(rng, tables, thing)


def _give_materials(
    rng: np.random.Generator, tables: Tables, things: list[Data], kinds: int
) -> None:
    """Make the matter consist of so many materials, in place."""
    weights, chosen = dict(tables.materials), []
    for _ in range(kinds):
        chosen.append(weighted(rng, weights))
        del weights[chosen[-1]]
    matter = [thing for thing in things if is_matter(thing)]
    order = rng.permutation(len(matter)).tolist()
    for n, i in enumerate(order):
        name = chosen[n] if n < kinds else str(rng.choice(chosen))
        if material_of(matter[i]) != name:
            give_material(rng, tables, matter[i], name)


def _recolor(rng: np.random.Generator, thing: Data, things: list[Data]) -> None:
    """A colour of its own; still obstacles are grey half of the time."""
    if thing["object_type"] == "static_collider" and rng.integers(2):
        return
    thing["visualization"]["color"] = free_color(rng, things)
