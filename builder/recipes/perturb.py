"""Perturbations: numeric jitter of a scene, its structure kept."""

import copy
import math

import numpy as np

from mpmworlds.builder.recipes.objects import Data, rounded, shortened
from mpmworlds.builder.recipes.quantities import Quantity, quantities
from mpmworlds.builder.recipes.tables import Tables
from mpmworlds.sim.scene.errors import SceneError
from mpmworlds.sim.scene.scene import Scene

TRIES = 40  # jitters of an object tried at each of the extents
EXTENTS = (1.0, 0.25)  # parts of the largest changes; then it is left as it is
SHAPES_AS_A_WHOLE = ("offset",)  # kinds whose numbers are one outline


def perturb(rng: np.random.Generator, tables: Tables, scene: Data) -> Data:
    """Jitter the objects of a scene in place; returns the record of the edit.

    Every number of an object changes as its kind says, up to the widths of the tables;
    one at the end of its range, such as a time that never comes, stays there. Colours,
    materials and the number of objects stay. Objects are jittered one after another,
    each so that the scene stays valid; one that has little room changes less, and one
    that has none stays as it is.
    """
    valid, jittered = Scene.from_data(scene), []
    for i, thing in enumerate(scene["objects"]):
        found = _jitter_within(rng, tables, valid, i, thing)
        if found:
            valid, scene["objects"][i] = found
            jittered.append(thing["name"])
    scene["simulation"]["seed"] = int(rng.integers(2**31))
    return {"operator": "perturb", "jittered": jittered}


def _jitter_within(
    rng: np.random.Generator, tables: Tables, scene: Scene, i: int, origin: Data
) -> tuple[Scene, Data] | None:
    """Jitter object i so that the scene stays valid; None if there is no room."""
    for extent in sorted(TRIES * EXTENTS, reverse=True):
        thing = copy.deepcopy(origin)
        for quantity in quantities(thing):
            _jitter(rng, tables, quantity, extent)
        try:
            return scene.with_object(i, thing), thing
        except SceneError:
            continue
    return None


def _jitter(
    rng: np.random.Generator, tables: Tables, quantity: Quantity, extent: float
) -> None:
    """Change a number by up to a part of its width, in place."""
    width = tables.jitter.get(quantity.kind)
    if width is None or quantity.value == quantity.most:
        return

    def factor() -> float:
        return math.exp(math.log(width.factor) * extent * rng.uniform(-1.0, 1.0))

    def shifted(value: float) -> float:
        return rounded(value + extent * rng.uniform(-width.shift, width.shift))

    if width.shift:
        quantity.change(shifted)
    elif quantity.kind in SHAPES_AS_A_WHOLE:
        whole = factor()
        quantity.change(lambda x: rounded(x * whole))
    else:
        quantity.change(lambda x: shortened(x * factor()))
