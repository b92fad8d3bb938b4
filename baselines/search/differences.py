"""What differs between two scenes, number by number, things paired by their colours."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, Final

from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene

Data = dict[str, Any]

DIGITS: Final = 4  # that are shown of a number
SAME: Final = 1e-9  # relative difference that is none
UNSEEN: Final = ("name", "visualization")
_COLORS: Final = {color: name for name, color in PALETTE.items()}


@dataclass(frozen=True)
class Difference:
    """One field that two scenes have differently."""

    place: str
    """Where it is, e.g. ``red box: shape.size``."""
    truth: Any
    """Its value in the first scene; None if it has no such field."""
    found: Any
    """Its value in the second one."""

    def __str__(self) -> str:
        return f"{self.place}: {_shown(self.truth)} -> {_shown(self.found)}"


def differences(truth: Scene, found: Scene) -> Iterator[Difference]:
    """Fields of two scenes that differ; names and the order of things do not count."""
    one, other = truth.to_data(), found.to_data()
    for part in ("simulation", "environment", "output"):
        yield from _of_fields(one[part], other[part], part)
    for thing, match in paired(one["objects"], other["objects"]):
        known = thing or match or {}
        color = known["visualization"]["color"]
        name = _COLORS.get(color, color).replace("_", " ")
        what = f"{name} {known['shape']['type'].replace('_', ' ')}"
        if thing is None or match is None:
            present = [None if t is None else t["object_type"] for t in (thing, match)]
            yield Difference(what, *present)
        else:
            yield from _of_fields(thing, match, f"{what}: ")


def paired(
    truth: Sequence[Data], found: Sequence[Data]
) -> Iterator[tuple[Data | None, Data | None]]:
    """Things of two scenes: of one colour, the nearest ones; what is left alone."""
    left = list(found)
    for thing in truth:
        color = thing["visualization"]["color"]
        alike = [o for o in left if o["visualization"]["color"] == color]
        other = min(alike, key=lambda o: apart(thing, o), default=None)
        left = [o for o in left if o is not other]
        yield thing, other
    for other in left:
        yield None, other


def apart(one: Data, other: Data) -> float:
    """Distance of the centers of two things [m]."""
    return math.dist(one["shape"]["center"], other["shape"]["center"])


def _of_fields(
    one: Mapping[str, Any], other: Mapping[str, Any], place: str
) -> Iterator[Difference]:
    for key in {**one, **other}:
        if key in UNSEEN:
            continue
        a, b = one.get(key), other.get(key)
        path = f"{place}{key}" if place.endswith(": ") else f"{place}.{key}"
        if isinstance(a, Mapping) and isinstance(b, Mapping):
            yield from _of_fields(a, b, path)
        elif not _same(a, b):
            yield Difference(path, a, b)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, list) and isinstance(b, list):
        return all(_same(x, y) for x, y in zip_longest(a, b))
    if isinstance(a, float | int) and isinstance(b, float | int):
        return math.isclose(a, b, rel_tol=SAME, abs_tol=SAME)
    return bool(a == b)


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, float):
        return f"{value:.{DIGITS}g}"
    if isinstance(value, list):
        return f"[{', '.join(map(_shown, value))}]"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_shown(part)}" for key, part in value.items())
    return str(value)
