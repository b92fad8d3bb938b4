"""Motions of objects: of bodies at the start, of nozzles, of colliders.

A motion of a collider is a function that draws its numbers; `MOTIONS` names them all.
"""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from mpmworlds.builder.recipes.objects import Data, NoRoomError, rounded, weighted
from mpmworlds.builder.recipes.quantities import shape_of
from mpmworlds.builder.recipes.tables import Tables

TIP_SPEED: Final = 4.0  # of a new motion, at most [m/s]
LEAST_REACH: Final = 0.01  # m


def set_in_motion(rng: np.random.Generator, tables: Tables, thing: Data) -> str:
    """Give a collider, a body or a nozzle another motion, in place; returns which.

    Raises
    ------
    NoRoomError
        If it has no valid shape.
    """
    if thing["object_type"] == "dynamic_body":
        velocity = [rounded(rng.uniform(-2.0, 2.0)), rounded(rng.uniform(-2.0, 1.5))]
        thing["initial_state"]["velocity"] = velocity
        return "throw"
    if thing["object_type"] == "emitter":
        _turn_nozzle(thing, rounded(rng.uniform(-60.0, 60.0), 1))
        return "aim"
    kind = _kind(rng, tables, thing["shape"])
    sign = float(rng.choice([-1.0, 1.0]))
    thing["object_type"] = "kinematic_collider"
    thing["kinematics"] = {"type": kind} | MOTIONS[kind](rng, thing["shape"], sign)
    if kind == "conveyor":
        thing["contact"] = thing["contact"] | {"type": "slip", "friction": 0.8}
    return kind


def _turn_nozzle(thing: Data, degrees: float) -> None:
    """Turn a nozzle and what leaves it about its center."""
    x, y = thing["emission"]["velocity"]
    turned = complex(x, y) * np.exp(1j * math.radians(degrees))
    thing["emission"]["velocity"] = [rounded(turned.real), rounded(turned.imag)]
    thing["shape"]["angle_deg"] = rounded(thing["shape"]["angle_deg"] + degrees, 2)


def _kind(rng: np.random.Generator, tables: Tables, shape: Data) -> str:
    """A kind of motion that suits a shape."""
    weights = dict(tables.motions)
    if shape["type"] == "circle":  # whose turning nobody sees
        weights.pop("rotate", None)
    if shape["type"] not in tables.belts:
        weights.pop("conveyor", None)
    if not weights:
        raise NoRoomError(f"no motion suits a {shape['type']}")
    return str(weighted(rng, weights))


def rotate(rng: np.random.Generator, shape: Data, sign: float) -> Data:
    """A turn about the center."""
    fastest = min(TIP_SPEED / _reach(shape), 20.0)
    return {"angular_velocity": rounded(sign * rng.uniform(0.3, 1.0) * fastest)}


def conveyor(rng: np.random.Generator, shape: Data, sign: float) -> Data:
    """A belt around the shape."""
    return {"surface_speed": rounded(sign * rng.uniform(0.5, 2.0))}


def translate(rng: np.random.Generator, shape: Data, sign: float) -> Data:
    """A way along an axis."""
    across = bool(rng.integers(2))
    speed, way = sign * rng.uniform(0.15, 0.6), rng.uniform(0.1, 0.35)
    start = rounded(rng.uniform(0.0, 0.3), 3)
    return {
        "velocity": [rounded(speed), 0.0] if across else [0.0, rounded(speed)],
        "start": start,
        "stop": rounded(start + way / abs(speed), 3),
    }


def oscillate(rng: np.random.Generator, shape: Data, sign: float) -> Data:
    """To and fro along an axis, or about the center."""
    across = bool(rng.integers(2))
    motion: Data = {"phase_deg": sign * 90.0}
    if rng.uniform() < 0.4 and shape["type"] != "circle":
        motion["amplitude_deg"] = rounded(rng.uniform(12.0, 45.0), 1)
        swing = math.radians(motion["amplitude_deg"]) * _reach(shape)
    else:
        swing = rng.uniform(0.04, 0.15)
        motion["amplitude"] = [rounded(swing), 0.0] if across else [0.0, rounded(swing)]
    fastest = min(TIP_SPEED / (2.0 * math.pi * swing), 4.0)
    return motion | {"frequency": rounded(rng.uniform(0.3, 1.0) * fastest, 2)}


MOTIONS: Final[dict[str, Callable[[np.random.Generator, Data, float], Data]]] = {
    "conveyor": conveyor,
    "oscillate": oscillate,
    "rotate": rotate,
    "translate": translate,
}


def _reach(shape: Data) -> float:
    """How far a shape reaches from its center [m]."""
    return max(shape_of(shape).reach(), LEAST_REACH)
