"""What a search got right of scenes: types, shapes, materials, numbers.

For people to read; no predictor sees any of it.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.differences import apart, paired
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.trials.lab import Lab
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.scene.scene import Scene

Data = dict[str, Any]

SAME_PREFIX: Final = 0.02  # loss below which two scenes draw the same prefix
COLUMNS: Final = ("type", "shape", "material", "place", "speed", "numbers")


@dataclass(frozen=True)
class Match:
    """A thing of a true scene, and how it was found; None where nothing compares."""

    family: str
    """Its material, else its object type."""
    type: float
    """1 if its object type is right."""
    shape: float | None
    """1 if its shape is of the right kind."""
    material: float | None
    """1 if its class is right."""
    place: float | None
    """Distance of centers [m]."""
    speed: float | None
    """Difference of velocities at the start or at birth [m/s]."""
    numbers: float | None
    """Mean absolute log ratio of the numbers of its material, if the class is right."""


def matches(truth: Mapping[str, Any], found: Mapping[str, Any]) -> Iterator[Match]:
    """Compare two scenes in plain data, thing by thing of the same colour."""
    for thing, other in paired(truth["objects"], found["objects"]):
        if thing is not None:
            yield _match(thing, other)


def _match(thing: Data, other: Data | None) -> Match:
    true = thing.get("physics_properties") or {}
    family = str(true.get("constitutive_model", thing["object_type"]))
    if other is None or other["object_type"] != thing["object_type"]:
        return Match(family, 0.0, None, None, None, None, None)
    nozzle = thing["object_type"] == "emitter"
    got = other.get("physics_properties") or {}
    right = true.get("constitutive_model") == got.get("constitutive_model")
    return Match(
        family,
        type=1.0,
        shape=None
        if nozzle
        else float(thing["shape"]["type"] == other["shape"]["type"]),
        material=float(right) if true else None,
        place=apart(thing, other),
        speed=_speed(thing, other),
        numbers=_numbers(true, got) if true and right else None,
    )


def _speed(one: Data, other: Data) -> float | None:
    for part in ("initial_state", "emission", "kinematics"):
        a, b = (thing.get(part, {}).get("velocity") for thing in (one, other))
        if a is not None and b is not None:
            return math.dist(a, b)
    return None


def _numbers(one: Mapping[str, Any], other: Mapping[str, Any]) -> float | None:
    ratios = [
        abs(math.log(other[key] / value))
        for key, value in one.items()
        if isinstance(value, float) and value > 0.0 and other.get(key, 0.0) > 0.0
    ]
    return float(np.mean(ratios)) if ratios else None


def apart_in_prefix(prefix: Frames, form: VideoForm, found: Scene) -> float:
    """Loss of a scene's prefix against one that is seen.

    Below `SAME_PREFIX` what differs between the scenes behind them cannot be told from
    the prefix, and is no error of who looked at it.
    """
    with Lab(labels_of(prefix), form, 1, 1e6) as lab:
        return lab.loss(found.to_data())


def table(found: Sequence[Match]) -> str:
    """Means by family, as Markdown; a dash where nothing compares."""
    by_family: dict[str, list[Match]] = defaultdict(list)
    for match in found:
        by_family[match.family].append(match)
    lines = [
        f"| family | n | {' | '.join(COLUMNS)} |",
        "|---" * (2 + len(COLUMNS)) + "|",
    ]
    rows = [*sorted(by_family.items()), ("all", list(found))]
    for family, group in rows:
        cells = [_mean([getattr(m, column) for m in group]) for column in COLUMNS]
        lines.append(f"| {family} | {len(group)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _mean(values: Sequence[float | None]) -> str:
    there = [value for value in values if value is not None]
    return f"{np.mean(there):.3f}" if there else "-"
