"""Perturbations: numeric jitter of a scene, its structure kept."""

import copy
from typing import Any

import numpy as np

from mpmworlds.builder.parts import Data, rounded
from mpmworlds.sim.scene.errors import SceneError
from mpmworlds.sim.scene.scene import Scene

SHIFT = 0.04  # largest displacement of an object along an axis [m]
TURN = 12.0  # largest turn [deg]
RATIO = 1.2  # largest factor on lengths, motions and material parameters
TRIES = 40  # jitters of an object tried at each of the extents
EXTENTS = (1.0, 0.25)  # parts of the largest changes; then it is left as it is
LENGTHS = (
    *("radius", "size", "semi_axes", "corner_radius", "length"),
    *("blade_length", "thickness", "opening_deg"),
)
MOTIONS = (
    *("velocity", "angular_velocity", "surface_speed"),
    *("amplitude", "amplitude_deg", "frequency"),
)
EMISSIONS = ("velocity", "swing_deg", "period", "drop_radius")
MATERIALS = (
    *("density", "youngs_modulus", "bulk_modulus", "viscosity", "damping"),
    *("yield_stress", "hardening_modulus", "consistency", "relaxation_time"),
    "cohesion",
)


def perturb(rng: np.random.Generator, scene: Data) -> Data:
    """Jitter the objects of a scene in place; returns the record of the edit.

    Places move by up to `SHIFT`, angles by up to `TURN`, and lengths, motions and
    material parameters change by a factor of up to `RATIO` either way. Colours,
    materials and the number of objects stay. Objects are jittered one after another,
    each so that the scene stays valid; one that has little room changes less, and one
    that has none stays as it is.
    """
    valid, jittered = Scene.from_data(scene), []
    for i, thing in enumerate(scene["objects"]):
        found = _jitter_within(rng, valid, i, thing)
        if found:
            valid, scene["objects"][i] = found
            jittered.append(thing["name"])
    scene["simulation"]["seed"] = int(rng.integers(2**31))
    return {"operator": "perturb", "jittered": jittered}


def _jitter_within(
    rng: np.random.Generator, scene: Scene, i: int, origin: Data
) -> tuple[Scene, Data] | None:
    """Jitter object i so that the scene stays valid; None if there is no room."""
    for extent in sorted(TRIES * EXTENTS, reverse=True):
        thing = copy.deepcopy(origin)
        _jitter(rng, thing, extent)
        try:
            return scene.with_object(i, thing), thing
        except SceneError:
            continue
    return None


def _jitter(rng: np.random.Generator, thing: Data, extent: float) -> None:
    def moved(value: float, most: float, digits: int = 4) -> float:
        return rounded(value + extent * rng.uniform(-most, most), digits)

    def scaled(value: Any) -> Any:
        if isinstance(value, list):
            return [scaled(x) for x in value]
        return rounded(value * RATIO ** (extent * rng.uniform(-1.0, 1.0)))

    shape = thing["shape"]
    shape["center"] = [moved(x, SHIFT) for x in shape["center"]]
    if "angle_deg" in shape and shape["type"] != "polygon":
        shape["angle_deg"] = moved(shape["angle_deg"], TURN, 2)
    for part, keys in (
        (shape, LENGTHS),
        (thing.get("initial_state", {}), MOTIONS),
        (thing.get("kinematics", {}), MOTIONS),
        (thing.get("emission", {}), EMISSIONS),
        (thing.get("physics_properties", {}), MATERIALS),
    ):
        for key in keys:
            if key in part:
                part[key] = scaled(part[key])
