"""Small changes of a scene: what refinement tries, number by number."""

import copy
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from mpmworlds.baselines.search.prior import FRICTIONLESS
from mpmworlds.baselines.search.repair import scaled

Data = dict[str, Any]

MOST_FRICTION: Final = 1.0
FAINTEST: Final = 0.2  # what the number of a thing promises that is drawn best
SIDES: Final = {"size", "semi_axes"}  # of shapes that may be longer than wide
SWINGS: Final = {"swing_deg", "period"}  # of a hose
STRENGTH: Final = 1.0  # what the strongest number of a material promises

STRONGEST: Final = {  # what each class is told by most
    "liquid": ("viscosity", "bulk_modulus"),
    "elastic": ("youngs_modulus",),
    "elastic_fem": ("youngs_modulus",),
    "rigid": ("restitution", "friction"),
    "snow": ("youngs_modulus",),
    "sand": ("friction_angle_deg",),
    "wet_sand": ("cohesion",),
    "plastic": ("yield_stress",),
    "viscoplastic": ("consistency", "yield_stress"),
    "viscoelastic": ("youngs_modulus", "relaxation_time"),
}


@dataclass(frozen=True)
class Move:
    """A number of a scene that may be changed."""

    what: str
    """For people and traces."""
    step: float
    """How far, at first."""
    weight: float
    """What it promises, of 0 to 1."""
    change: Callable[[Data, float], None]
    """Changes a scene by a step of a size and sign."""

    def of(self, data: Data, step: float) -> Data:
        """A changed copy."""
        changed = copy.deepcopy(data)
        self.change(changed, step)
        return changed


@dataclass(frozen=True)
class Doubt:
    """What may be changed of a scene."""

    told: Mapping[int, Mapping[str, Any]]
    """What is told of each object, by its number."""
    flights: Mapping[int, float]
    """By the numbers of bodies that were seen to fly, for how long [s]."""
    started: Collection[int]
    """Numbers of bodies that flew so long that how they start is certain."""
    gravity: Sequence[int]
    """Axes along which gravity is neither told nor the earth's."""
    walls: bool
    """Whether the walls are not told."""


def moves_of(
    data: Data, doubt: Doubt, by_color: Mapping[str, float], *, fine: bool = False
) -> Iterator[Move]:
    """Moves of what is in doubt.

    Parameters
    ----------
    data
        The scene.
    doubt
        What may be changed.
    by_color
        Losses of colours, which say where there is something to be gained.
    fine
        Whether all else is so near that what shows least is worth a run: the sizes of
        bodies, their angles, and how much they give way aside.
    """
    worst = max(by_color.values(), default=0.0) or 1.0
    for number, thing in enumerate(data["objects"]):
        loss = by_color.get(thing["visualization"]["color"], worst) / worst
        moves = [*_of_thing(number, thing, doubt)]
        if fine and thing["object_type"] == "dynamic_body":
            moves += _of_build(number, thing, doubt.told.get(number, {}))
        for move in moves:
            yield replace(move, weight=move.weight * max(loss, FAINTEST))
        if "contact" in thing and "contact" not in doubt.told.get(number, {}):
            yield Move(f"{number}.friction", 0.3, 0.4, _friction(number))
    if doubt.walls and data["environment"]["walls"]["contact"] not in FRICTIONLESS:
        yield Move("walls.friction", 0.1, 0.3, _rougher_walls)
    for axis in doubt.gravity:
        yield Move(f"gravity[{axis}]", 0.15, 0.35, pull(axis, doubt.flights))


def _of_thing(number: int, thing: Data, doubt: Doubt) -> Iterator[Move]:
    known = doubt.told.get(number, {})
    if "emission" in thing:
        yield from _of_nozzle(number, thing, known)
    elif "initial_state" in thing:
        state = known.get("initial_state") or {}
        if "velocity" not in state and number not in doubt.started:
            yield from _of_flight(number, flown=number in doubt.flights)
        if "angular_velocity" not in state and number not in doubt.started:
            flown = number in doubt.flights
            if not flown or thing["initial_state"]["angular_velocity"]:
                yield from _of_spin(number, thing, flown=flown)
    properties = thing.get("physics_properties")
    if properties and "density" not in (known.get("physics_properties") or {}):
        for place, key in enumerate(STRONGEST[properties["constitutive_model"]]):
            weight = STRENGTH * 0.6**place
            yield _scaling(number, ("physics_properties", key), 0.4, weight)
    if thing.get("kinematics", {}).get("type") == "conveyor":
        if "surface_speed" not in (known.get("kinematics") or {}):
            yield _scaling(number, ("kinematics", "surface_speed"), 0.3, 1.0)


def _of_build(number: int, thing: Data, known: Mapping[str, Any]) -> Iterator[Move]:
    """How a body is built: its size, seen to a fifth of a pixel, place and angle."""
    if not known.get("physics_properties", {}).get("density"):
        yield _scaling(number, ("physics_properties", "density"), 0.15, 0.25)
        if "poissons_ratio" in thing["physics_properties"]:
            path = ("physics_properties", "poissons_ratio")
            yield _scaling(number, path, 0.08, 0.3)
    if thing["initial_state"]["angular_velocity"] and spins_unseen(thing, known):
        yield Move(f"{number}.spin", 1.0, 0.3, _spun(number))
    if set(known.get("shape") or {}) - {"type", "center", "angle_deg"}:
        return

    def larger(data: Data, by: float) -> None:
        scaled(data["objects"][number]["shape"], math.exp(by))

    yield Move(f"{number}.size", 0.01, 0.2, larger)
    if "center" not in (known.get("shape") or {}):
        for axis in (0, 1):
            yield Move(f"{number}.center[{axis}]", 0.0004, 0.2, _aside(number, axis))
    if "angle_deg" in thing["shape"] and "angle_deg" not in (known.get("shape") or {}):
        yield Move(f"{number}.angle", 0.3, 0.2, _turned(number))
    if sides := SIDES & thing["shape"].keys():
        (key,) = sides

        def wider(data: Data, by: float) -> None:
            shape = data["objects"][number]["shape"]
            width, height = shape[key]
            shape[key] = [width * math.exp(by), height * math.exp(-by)]

        yield Move(f"{number}.aspect", 0.01, 0.2, wider)


def _aside(number: int, axis: int) -> Callable[[Data, float], None]:
    def change(data: Data, by: float) -> None:
        center = list(data["objects"][number]["shape"]["center"])
        center[axis] += by
        data["objects"][number]["shape"]["center"] = center

    return change


def _turned(number: int) -> Callable[[Data, float], None]:
    def change(data: Data, by: float) -> None:
        data["objects"][number]["shape"]["angle_deg"] += by

    return change


def _at(data: Data, number: int, path: tuple[str, ...]) -> tuple[Any, str]:
    place: Any = data["objects"][number]
    for key in path[:-1]:
        place = place[key]
    return place, path[-1]


def _scaling(number: int, path: tuple[str, ...], step: float, weight: float) -> Move:
    def change(data: Data, by: float) -> None:
        place, key = _at(data, number, path)
        place[key] *= math.exp(by)

    return Move(f"{number}.{'.'.join(path)}", step, weight, change)


def pull(axis: int, flights: Mapping[int, float]) -> Callable[[Data, float], None]:
    """Gravity, with velocities that leave what was seen of flights as it is."""

    def change(data: Data, by: float) -> None:
        gravity = list(data["environment"]["gravity"])
        gravity[axis] += by
        data["environment"]["gravity"] = gravity
        for number, lasting in flights.items():
            velocity = list(data["objects"][number]["initial_state"]["velocity"])
            # The line through by t^2 / 2 that is nearest to it from 0 to `lasting`.
            velocity[axis] -= 0.375 * by * lasting
            data["objects"][number]["initial_state"]["velocity"] = velocity

    return change


def _friction(number: int) -> Callable[[Data, float], None]:
    def change(data: Data, by: float) -> None:
        _roughen(data["objects"][number]["contact"], by)

    return change


def _rougher_walls(data: Data, by: float) -> None:
    _roughen(data["environment"]["walls"], by)


def _roughen(surface: Data, by: float) -> None:
    surface["friction"] = min(max(surface["friction"] + by, 0.0), MOST_FRICTION)


def _of_flight(number: int, *, flown: bool) -> Iterator[Move]:
    """What was seen to fly is right to a hundredth, else to a tenth [m/s]."""
    for axis in (1, 0):

        def change(data: Data, by: float, axis: int = axis) -> None:
            velocity = list(data["objects"][number]["initial_state"]["velocity"])
            velocity[axis] += by
            data["objects"][number]["initial_state"]["velocity"] = velocity

        step, weight = (0.02, 0.4) if flown else (0.12, 0.9)
        yield Move(f"{number}.velocity[{axis}]", step, weight, change)


def _of_spin(number: int, thing: Data, *, flown: bool) -> Iterator[Move]:
    if thing["shape"]["type"] == "circle":  # none that is seen
        return

    step, weight = (0.1, 0.35) if flown else (0.6, 0.7)
    yield Move(f"{number}.spin", step, weight, _spun(number))


def started(data: Data, number: int, **state: Any) -> Data:
    """A scene of which a body starts otherwise."""
    changed = copy.deepcopy(data)
    changed["objects"][number]["initial_state"] |= state
    return changed


def spins_unseen(thing: Data, known: Mapping[str, Any]) -> bool:
    """Whether it is not seen of a body, nor told, if it spins before it lands."""
    told = "angular_velocity" in (known.get("initial_state") or {})
    return "initial_state" in thing and thing["shape"]["type"] == "circle" and not told


def _spun(number: int) -> Callable[[Data, float], None]:
    def change(data: Data, by: float) -> None:
        data["objects"][number]["initial_state"]["angular_velocity"] += by

    return change


def aimed(number: int) -> Callable[[Data, float], None]:
    """A jet that is turned about its nozzle [rad]."""

    def change(data: Data, by: float) -> None:
        thing = data["objects"][number]
        u, v = thing["emission"]["velocity"]
        cos, sin = math.cos(by), math.sin(by)
        thing["emission"]["velocity"] = [cos * u - sin * v, sin * u + cos * v]
        thing["shape"]["angle_deg"] += math.degrees(by)

    return change


def _of_nozzle(number: int, thing: Data, known: Mapping[str, Any]) -> Iterator[Move]:
    emission = known.get("emission") or {}
    if "rate" not in emission:
        yield _scaling(number, ("emission", "rate"), 0.15, 0.9)
    if "velocity" not in emission:

        def faster(data: Data, by: float) -> None:
            found = data["objects"][number]["emission"]
            found["velocity"] = [v * math.exp(by) for v in found["velocity"]]
            if "rate" not in emission:  # it stays as dense
                found["rate"] *= math.exp(by)

        yield Move(f"{number}.speed", 0.12, 0.9, faster)
        if thing["emission"]["type"] != "rain":
            yield Move(f"{number}.direction", 0.05, 0.6, aimed(number))
    for key in sorted(SWINGS & thing["emission"].keys() - emission.keys()):
        yield _scaling(number, ("emission", key), 0.1, 0.6)
    if "size" not in (known.get("shape") or {}):

        def wider(data: Data, by: float) -> None:
            shape = data["objects"][number]["shape"]
            shape["size"] = [shape["size"][0] * math.exp(by), shape["size"][1]]
            if "rate" not in emission:
                data["objects"][number]["emission"]["rate"] *= math.exp(by)

        yield Move(f"{number}.width", 0.15, 0.7, wider)
