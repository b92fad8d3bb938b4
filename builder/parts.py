"""What edits do to the plain data of objects: sizes, places, motions, looks, matter."""

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from mpmworlds.sim.scene.palette import PALETTE, hue_difference, saturation

Data = dict[str, Any]
HUE_STEP: Final = 30.0  # least hue difference of a new object's colour [deg]
MOVING_PARTS: Final = ("initial_state", "kinematics", "emission")
VECTORS: Final = ("velocity", "amplitude")  # their x changes sign in a mirror
TURNS: Final = (  # and so do these
    *("angle_deg", "angular_velocity", "amplitude_deg"),
    *("surface_speed", "swing_deg"),
)
VIVID: Final = [color for color in PALETTE.values() if saturation(color) > 0.5]
TIP_SPEED: Final = 4.0  # of a new motion, at most [m/s]
BELTS: Final = ("box", "capsule", "rounded_box")  # shapes that may be conveyors
NOT_EMITTED: Final = ("rigid", "elastic_fem")  # materials of bodies only
MATERIALS: Final[dict[str, Data]] = {
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


class NoRoomError(ValueError):
    """An object has no room in a scene, or a draw does not fit its purpose."""


def rounded(value: float, digits: int = 4) -> float:
    """A number short enough to read: large ones keep four significant digits."""
    return float(f"{value:.4g}") if abs(value) >= 1.0 else round(float(value), digits)


def weighted(rng: np.random.Generator, weights: Mapping[str, float]) -> str:
    """One of the names, by weights that need not add up to one."""
    shares = np.array(list(weights.values()))
    return str(rng.choice(list(weights), p=shares / shares.sum()))


def is_matter(thing: Data) -> bool:
    """Whether an object consists of, or releases, matter."""
    return "physics_properties" in thing


def material_of(thing: Data) -> str:
    """Constitutive model of an object of matter."""
    return str(thing["physics_properties"]["constitutive_model"])


def give_material(rng: np.random.Generator, thing: Data, name: str) -> None:
    """Make an object consist of a material, with moduli and densities jittered.

    Raises
    ------
    NoRoomError
        If it is a nozzle, and the material one of bodies only.
    """
    if thing["object_type"] == "emitter" and name in NOT_EMITTED:
        raise NoRoomError(f"a nozzle cannot release {name}")
    properties: Data = {"constitutive_model": name} | MATERIALS[name]
    for key in ("density", "yield_stress", "viscosity", "consistency"):
        if key in properties:
            properties[key] = rounded(properties[key] * 1.4 ** rng.uniform(-1.0, 1.0))
    for key in ("youngs_modulus", "bulk_modulus"):  # softer only: the step is bound
        if key in properties:
            properties[key] = rounded(properties[key] * 0.5 ** rng.uniform(0.0, 1.0))
    thing["physics_properties"] = properties


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


def scale(thing: Data, factor: float) -> None:
    """Scale an object; a nozzle lets through as much more as it is wider."""
    scale_shape(thing["shape"], factor)
    if "emission" in thing:
        thing["emission"]["rate"] = rounded(thing["emission"]["rate"] * factor)


def mirror(thing: Data) -> None:
    """Exchange left and right of an object, in place."""
    shape = thing["shape"]
    shape["center"][0] = rounded(1.0 - shape["center"][0])
    for vertex in shape.get("vertices", []):
        vertex[0] = 0.0 - vertex[0]
    for part in (shape, *(thing.get(name, {}) for name in MOVING_PARTS)):
        for key in TURNS:
            if key in part:
                part[key] = 0.0 - part[key]
        for key in VECTORS:
            if key in part:
                part[key][0] = 0.0 - part[key][0]
    if shape["type"] == "fan_blades":  # its first blade points to the other side
        shape["angle_deg"] = (shape["angle_deg"] + 360.0) % 360.0 - 180.0


def free_color(rng: np.random.Generator, things: Sequence[Data]) -> str:
    """A vivid palette colour whose hue no coloured object is near.

    Where there is no room for another hue it is any vivid one, and no valid draw.
    """
    used = [thing["visualization"]["color"] for thing in things]
    hued = [color for color in used if saturation(color) > 0.2]
    free = [
        color
        for color in VIVID
        if all(hue_difference(color, other) > HUE_STEP for other in hued)
    ]
    return str(rng.choice(free or VIVID))


def set_in_motion(rng: np.random.Generator, thing: Data) -> str:
    """Give a collider, a body or a nozzle another motion, in place; returns which."""
    if thing["object_type"] == "dynamic_body":
        velocity = [rounded(rng.uniform(-2.0, 2.0)), rounded(rng.uniform(-2.0, 1.5))]
        thing["initial_state"]["velocity"] = velocity
        return "throw"
    if thing["object_type"] == "emitter":
        _turn_nozzle(thing, rounded(rng.uniform(-60.0, 60.0), 1))
        return "aim"
    thing["object_type"] = "kinematic_collider"
    thing["kinematics"] = _motion(rng, thing["shape"])
    if thing["kinematics"]["type"] == "conveyor":
        thing["contact"] = thing["contact"] | {"type": "slip", "friction": 0.8}
    return str(thing["kinematics"]["type"])


def _turn_nozzle(thing: Data, degrees: float) -> None:
    """Turn a nozzle and what leaves it about its center."""
    x, y = thing["emission"]["velocity"]
    turned = complex(x, y) * np.exp(1j * math.radians(degrees))
    thing["emission"]["velocity"] = [rounded(turned.real), rounded(turned.imag)]
    thing["shape"]["angle_deg"] = rounded(thing["shape"]["angle_deg"] + degrees, 2)


def _motion(rng: np.random.Generator, shape: Data) -> Data:
    """A new motion that suits a shape."""
    weights = {"oscillate": 1.0, "translate": 0.8}
    if shape["type"] != "circle":  # whose turning nobody sees
        weights["rotate"] = 1.2
    if shape["type"] in BELTS:
        weights["conveyor"] = 0.6
    kind = weighted(rng, weights)
    sign = float(rng.choice([-1.0, 1.0]))
    if kind == "rotate":
        fastest = min(TIP_SPEED / _reach(shape), 20.0)
        return {
            "type": kind,
            "angular_velocity": rounded(sign * rng.uniform(0.3, 1.0) * fastest),
        }
    if kind == "conveyor":
        return {"type": kind, "surface_speed": rounded(sign * rng.uniform(0.5, 2.0))}
    across = bool(rng.integers(2))
    if kind == "translate":
        speed, way = sign * rng.uniform(0.15, 0.6), rng.uniform(0.1, 0.35)
        start = rounded(rng.uniform(0.0, 0.3), 3)
        return {
            "type": kind,
            "velocity": [rounded(speed), 0.0] if across else [0.0, rounded(speed)],
            "start": start,
            "stop": rounded(start + way / abs(speed), 3),
        }
    motion: Data = {"type": kind, "phase_deg": sign * 90.0}
    if rng.uniform() < 0.4 and shape["type"] != "circle":
        motion["amplitude_deg"] = rounded(rng.uniform(12.0, 45.0), 1)
        swing = math.radians(motion["amplitude_deg"]) * _reach(shape)
    else:
        swing = rng.uniform(0.04, 0.15)
        motion["amplitude"] = [rounded(swing), 0.0] if across else [0.0, rounded(swing)]
    fastest = min(TIP_SPEED / (2.0 * math.pi * swing), 4.0)
    return motion | {"frequency": rounded(rng.uniform(0.3, 1.0) * fastest, 2)}


def _reach(shape: Data) -> float:
    """About how far a shape reaches from its center [m]."""
    lengths: list[float] = [
        *(shape.get(key, 0.0) for key in ("radius", "blade_length")),
        *(0.5 * shape.get(key, 0.0) for key in ("length", "thickness")),
        *(0.5 * math.hypot(*shape[key]) for key in ("size",) if key in shape),
        *(max(shape[key]) for key in ("semi_axes",) if key in shape),
        *(math.hypot(*vertex) for vertex in shape.get("vertices", [])),
    ]
    return max(*lengths, 0.01)


def renamed(things: Sequence[Data]) -> list[Data]:
    """Copies of objects with neutral names, numbered in order."""
    return [
        copy.deepcopy(thing) | {"name": f"object_{i}"} for i, thing in enumerate(things)
    ]
