"""Objects of a scene as plain data, which edits change in place."""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Data = dict[str, Any]


class NoRoomError(ValueError):
    """An object has no room in a scene, or a draw does not fit its purpose."""


def rounded(value: float, digits: int = 4) -> float:
    """A number short enough to read: large ones keep four significant digits."""
    return float(f"{value:.4g}") if abs(value) >= 1.0 else round(float(value), digits)


def shortened(value: float) -> float:
    """A number of four significant digits."""
    return float(f"{value:.4g}")


def weighted(rng: np.random.Generator, weights: Mapping[Any, float]) -> Any:
    """One of the keys, by weights that need not add up to one."""
    names = list(weights)
    shares = np.array([weights[name] for name in names])
    return names[rng.choice(len(names), p=shares / shares.sum())]


def is_matter(thing: Data) -> bool:
    """Whether an object consists of, or releases, matter."""
    return "physics_properties" in thing


def material_of(thing: Data) -> str:
    """Constitutive model of an object of matter."""
    return str(thing["physics_properties"]["constitutive_model"])


def renamed(things: Sequence[Data]) -> list[Data]:
    """Copies of objects with neutral names, numbered in order."""
    return [
        copy.deepcopy(thing) | {"name": f"object_{i}"} for i, thing in enumerate(things)
    ]
