"""Matter of an object: another material, with values about the typical ones."""

import numpy as np

from mpmworlds.builder.recipes.objects import Data, NoRoomError, shortened
from mpmworlds.builder.recipes.tables import Tables
from mpmworlds.sim.scene.fields import kind_of
from mpmworlds.sim.scene.objects import MATERIALS, RELEASED


def may_consist_of(thing: Data, name: str) -> bool:
    """Whether an object may consist of, or release, a material."""
    return thing["object_type"] != "emitter" or name in RELEASED


def give_material(
    rng: np.random.Generator, tables: Tables, thing: Data, name: str
) -> None:
    """Make an object consist of a material, in place.

    Raises
    ------
    NoRoomError
        If it is a nozzle, and the material one of bodies only.
    """
    if not may_consist_of(thing, name):
        raise NoRoomError(f"a nozzle cannot release {name}")
    properties: Data = {"constitutive_model": name} | tables.typical[name]
    for key in tables.typical[name]:
        if spread := tables.spread.get(kind_of(MATERIALS[name], key) or ""):
            least, most = np.log(spread)
            factor = float(np.exp(rng.uniform(least, most)))
            properties[key] = shortened(properties[key] * factor)
    thing["physics_properties"] = properties
