"""Small changes of a scene: what refinement tries, number by number."""

import copy
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

Data = dict[str, Any]

STRONGEST: Final = {  # what each class is told by most
    "liquid": ("viscosity",),
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
    change: Callable[[Data, float], None]
    """Changes a scene by a step of a size and sign."""

    def of(self, data: Data, step: float) -> Data:
        """A changed copy."""
        changed = copy.deepcopy(data)
        self.change(changed, step)
        return changed


def moves_of(
    data: Data, told: Mapping[int, Mapping[str, Any]], *, fly: Mapping[int, bool]
) -> Iterator[Move]:
    """Moves of what was not told, those that matter most first.

    Parameters
    ----------
    data
        The scene.
    told
        What is known of each object, by its number.
    fly
        By the numbers of bodies, whether their flight was seen well.
    """
    for number, thing in enumerate(data["objects"]):
        known = told.get(number, {})
        if "emission" in thing:
            yield from _of_nozzle(number, thing, known)
        elif "initial_state" in thing and not (known.get("initial_state") or {}).get(
            "velocity"
        ):
            if not fly.get(number, True):
                yield from _of_flight(number)
    for number, thing in enumerate(data["objects"]):
        properties = thing.get("physics_properties")
        known = told.get(number, {}).get("physics_properties") or {}
        if properties is None or "density" in known:
            continue
        for key in STRONGEST[properties["constitutive_model"]]:
            yield _scaling(number, ("physics_properties", key), 0.4)
    for number, thing in enumerate(data["objects"]):
        if "contact" in thing and "contact" not in told.get(number, {}):
            yield Move(f"{number}.friction", 0.3, _friction(number))


def _at(data: Data, number: int, path: tuple[str, ...]) -> tuple[Any, str]:
    place: Any = data["objects"][number]
    for key in path[:-1]:
        place = place[key]
    return place, path[-1]


def _scaling(number: int, path: tuple[str, ...], step: float) -> Move:
    def change(data: Data, by: float) -> None:
        place, key = _at(data, number, path)
        place[key] *= math.exp(by)

    return Move(f"{number}.{'.'.join(path)}", step, change)


def _friction(number: int) -> Callable[[Data, float], None]:
    def change(data: Data, by: float) -> None:
        contact = data["objects"][number]["contact"]
        contact["friction"] = min(max(contact["friction"] + by, 0.0), 2.0)

    return change


def _of_flight(number: int) -> Iterator[Move]:
    for axis in (1, 0):

        def change(data: Data, by: float, axis: int = axis) -> None:
            velocity = list(data["objects"][number]["initial_state"]["velocity"])
            velocity[axis] += by
            data["objects"][number]["initial_state"]["velocity"] = velocity

        yield Move(f"{number}.velocity[{axis}]", 0.12, change)


def _of_nozzle(number: int, thing: Data, known: Mapping[str, Any]) -> Iterator[Move]:
    emission = known.get("emission") or {}
    if "rate" not in emission:
        yield _scaling(number, ("emission", "rate"), 0.15)
    if "velocity" not in emission:

        def faster(data: Data, by: float) -> None:
            found = data["objects"][number]["emission"]
            found["velocity"] = [v * math.exp(by) for v in found["velocity"]]

        yield Move(f"{number}.speed", 0.12, faster)
    if "size" not in (known.get("shape") or {}):

        def wider(data: Data, by: float) -> None:
            shape = data["objects"][number]["shape"]
            shape["size"] = [shape["size"][0] * math.exp(by), shape["size"][1]]

        yield Move(f"{number}.width", 0.15, wider)
