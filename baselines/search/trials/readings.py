"""Scenes that were tried, and what sets them apart."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from mpmworlds.sim.scene.objects import RELEASED

Data = dict[str, Any]

ALIKE: Final = 3.0  # ratio of typical numbers of two classes that are of one kind
COARSELY: Final = 2.5  # of gravities [m/s^2]
UNBALANCED: Final = ("ring",)  # shapes that no rigid body has if they are open


@dataclass(frozen=True)
class Trial:
    """A scene that was run, and how far its prefix is off."""

    loss: float
    """Of the whole prefix, with what is unusual about the scene."""
    data: Data
    """Plain data."""
    what: str
    """The change that made it."""
    spent: float = 0.0
    """Of the budget when it was run [s]."""


def may_be(thing: Mapping[str, Any], name: str) -> bool:
    """Whether a thing may be of a class."""
    if thing["object_type"] == "emitter":
        return name in RELEASED
    shape = thing["shape"]
    open_ = shape["type"] in UNBALANCED and shape.get("opening_deg", 0.0) > 0.0
    return name != "rigid" or not open_


def shared(one: Data, other: Data) -> Iterator[str]:
    """Numbers that two typical materials have and that are about as large."""
    for key in sorted(one.keys() & other.keys() - {"constitutive_model"}):
        low, high = sorted((one[key], other[key]))
        if 0.0 < high <= ALIKE * low:
            yield key


def class_of(thing: Mapping[str, Any]) -> str:
    """Class of a body or an emitter."""
    return str(thing["physics_properties"]["constitutive_model"])


def classes_of(data: Data) -> tuple[str, ...]:
    """Classes of all matter of a scene."""
    return tuple(class_of(t) for t in data["objects"] if "physics_properties" in t)


def pull_of(data: Data) -> tuple[int, int]:
    """Gravity of a scene, roughly."""
    x, y = (round(g / COARSELY) for g in data["environment"]["gravity"])
    return x, y


def reading_of(data: Data) -> tuple[Any, ...]:
    """What scenes differ in by more than small numbers."""
    kinds = tuple(thing["object_type"] for thing in data["objects"])
    walls = data["environment"]["walls"]["contact"]
    return classes_of(data), pull_of(data), walls, kinds


def distinct(trials: Sequence[Trial], by: Any) -> list[Trial]:
    """The best trial of each kind, best first."""
    return list(_first_of_each(sorted(trials, key=lambda t: t.loss), by))


def _first_of_each(trials: Sequence[Trial], by: Any) -> Iterator[Trial]:
    seen = set()
    for trial in trials:
        if (key := by(trial.data)) not in seen:
            seen.add(key)
            yield trial
