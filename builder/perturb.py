"""Perturbations: numeric jitter of a scene, its structure kept."""

from typing import Any

import numpy as np

from mpmworlds.builder.attempt import Data

SHIFT = 0.04  # largest displacement of an object along an axis [m]
TURN = 12.0  # largest turn [deg]
RATIO = 1.2  # largest factor on lengths, speeds and material parameters
LENGTHS = ("radius", "blade_length", "thickness")
MOTIONS = ("velocity", "angular_velocity")
MATERIALS = ("density", "youngs_modulus", "bulk_modulus", "viscosity", "damping")


def perturb(rng: np.random.Generator, scene: Data) -> Data:
    """Jitter every object of a scene in place; returns the record of the edit.

    Places move by up to `SHIFT`, angles by up to `TURN`, and lengths, speeds and
    material parameters change by a factor of up to `RATIO` either way. Colours,
    materials and the number of objects stay.
    """
    for thing in scene["objects"]:
        _jitter(rng, thing)
    scene["simulation"]["seed"] = int(rng.integers(2**31))
    return {"operator": "perturb", "shift": SHIFT, "turn": TURN, "ratio": RATIO}


def _jitter(rng: np.random.Generator, thing: Data) -> None:
    shape = thing["shape"]
    shape["center"] = [rounded(x + rng.uniform(-SHIFT, SHIFT)) for x in shape["center"]]
    if "angle_deg" in shape and shape["type"] != "polygon":
        shape["angle_deg"] = rounded(shape["angle_deg"] + rng.uniform(-TURN, TURN), 2)
    for key in LENGTHS:
        _scale(rng, shape, key)
    if "size" in shape:
        shape["size"] = [rounded(x * _factor(rng)) for x in shape["size"]]
    for part in ("initial_state", "kinematics", "emission"):
        for key in MOTIONS:
            _scale(rng, thing.get(part, {}), key)
    for key in MATERIALS:
        _scale(rng, thing.get("physics_properties", {}), key)


def _scale(rng: np.random.Generator, part: Data, key: str) -> None:
    value: Any = part.get(key)
    if isinstance(value, list):
        part[key] = [rounded(x * _factor(rng)) for x in value]
    elif value is not None:
        part[key] = rounded(value * _factor(rng))


def _factor(rng: np.random.Generator) -> float:
    return float(RATIO ** rng.uniform(-1.0, 1.0))


def rounded(value: float, digits: int = 4) -> float:
    """A number short enough to read: large ones keep four significant digits."""
    return float(f"{value:.4g}") if abs(value) >= 1.0 else round(float(value), digits)
