"""Children: one structured edit of a scene."""

from collections.abc import Callable

import numpy as np

from mpmworlds.builder.attempt import Data
from mpmworlds.builder.perturb import rounded

MATERIALS: dict[str, Data] = {
    "liquid": {"density": 1000.0, "bulk_modulus": 4.5e5, "viscosity": 0.05},
    "elastic": {
        "density": 1000.0,
        "youngs_modulus": 3.0e5,
        "poissons_ratio": 0.3,
        "damping": 0.0,
    },
    "elastic_fem": {
        "density": 1000.0,
        "youngs_modulus": 3.0e5,
        "poissons_ratio": 0.3,
        "damping": 0.0,
    },
    "rigid": {"density": 800.0, "restitution": 0.3, "friction": 0.3},
    "snow": {"density": 400.0, "youngs_modulus": 3.5e4, "poissons_ratio": 0.2},
    "sand": {
        "density": 1600.0,
        "youngs_modulus": 7.0e5,
        "poissons_ratio": 0.25,
        "friction_angle_deg": 34.0,
    },
    "wet_sand": {
        "density": 1600.0,
        "youngs_modulus": 7.0e5,
        "poissons_ratio": 0.25,
        "friction_angle_deg": 34.0,
        "cohesion": 2.0e3,
        "saturation": 0.4,
    },
    "plastic": {
        "density": 1200.0,
        "youngs_modulus": 4.0e5,
        "poissons_ratio": 0.35,
        "yield_stress": 6.0e3,
    },
    "viscoplastic": {
        "density": 1200.0,
        "youngs_modulus": 3.0e5,
        "poissons_ratio": 0.4,
        "yield_stress": 150.0,
        "consistency": 300.0,
    },
    "viscoelastic": {
        "density": 1000.0,
        "youngs_modulus": 1.2e5,
        "poissons_ratio": 0.45,
        "relaxation_time": 0.03,
    },
}


def swap_material(rng: np.random.Generator, scene: Data) -> Data:
    """Give one object of particles another material."""
    things = [o for o in scene["objects"] if "physics_properties" in o]
    thing = things[rng.integers(len(things))]
    before = thing["physics_properties"]["constitutive_model"]
    after = str(rng.choice([name for name in sorted(MATERIALS) if name != before]))
    thing["physics_properties"] = {"constitutive_model": after} | MATERIALS[after]
    return {"object": thing["name"], "from": before, "to": after}


def remove_object(rng: np.random.Generator, scene: Data) -> Data:
    """Take one object away; a scene without particles is no valid draw."""
    i = int(rng.integers(len(scene["objects"])))
    return {"object": scene["objects"].pop(i)["name"]}


def change_gravity(rng: np.random.Generator, scene: Data) -> Data:
    """Make gravity weaker and oblique."""
    angle = np.radians(rng.uniform(-35.0, 35.0))
    strength = rng.uniform(3.0, 9.8)
    gravity = [rounded(strength * np.sin(angle)), rounded(-strength * np.cos(angle))]
    before = scene["environment"]["gravity"]
    scene["environment"]["gravity"] = gravity
    return {"from": before, "to": gravity}


def change_contact(rng: np.random.Generator, scene: Data) -> Data:
    """Change the contact law of the walls and of every collider."""
    before = scene["environment"]["walls"]["contact"]
    laws = [law for law in ("sticky", "slip", "separate") if law != before]
    after = str(rng.choice(laws))
    scene["environment"]["walls"]["contact"] = after
    for thing in scene["objects"]:
        if "contact" in thing:
            thing["contact"]["type"] = after
    return {"from": before, "to": after}


def resize_object(rng: np.random.Generator, scene: Data) -> Data:
    """Make one object markedly larger or smaller."""
    thing = scene["objects"][rng.integers(len(scene["objects"]))]
    factor = rounded(rng.choice([rng.uniform(0.5, 0.75), rng.uniform(1.3, 1.7)]), 2)
    scale_shape(thing["shape"], factor)
    return {"object": thing["name"], "factor": factor}


def scale_shape(shape: Data, factor: float) -> None:
    """Scale a shape about its center, in place; the thickness of walls stays."""
    for key in ("radius", "corner_radius", "length", "blade_length"):
        if key in shape:
            shape[key] = rounded(shape[key] * factor)
    for key in ("size", "semi_axes"):
        if key in shape:
            shape[key] = [rounded(x * factor) for x in shape[key]]
    if "vertices" in shape:
        shape["vertices"] = [
            [rounded(x * factor) for x in vertex] for vertex in shape["vertices"]
        ]


EDITS: dict[str, Callable[[np.random.Generator, Data], Data]] = {
    "change_contact": change_contact,
    "change_gravity": change_gravity,
    "remove_object": remove_object,
    "resize_object": resize_object,
    "swap_material": swap_material,
}


def modify(rng: np.random.Generator, scene: Data) -> Data:
    """Apply one edit, drawn at random, in place; returns the record of the edit."""
    name = str(rng.choice(sorted(EDITS)))
    return {"operator": name} | EDITS[name](rng, scene)
