"""How alike two scenes are: by structure, by numbers, and by what is seen first.

Two scenes have the same structure if they hold the same multiset of objects by type,
shape, material and motion or emission. Names, colours, the order of the objects and the
seed of the jitter never count.
"""

import math
from collections import Counter
from itertools import groupby, permutations
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mpmworlds.sim.scene.outlines import paint
from mpmworlds.sim.scene.scene import Scene

Numbers = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]
Mask = npt.NDArray[np.bool_]
LAWS: Final = ("sticky", "slip", "separate")
MOST_ALIKE: Final = 4  # objects of one kind that are matched in all orders


def structure(scene: Scene) -> str:
    """Multiset of the objects' types, shapes, materials, and motions or emissions.

    Parameters
    ----------
    scene
        A scene.

    Returns
    -------
    str
        Canonical text, such as "dynamic_body box liquid; 2 static_collider circle".
    """
    counts = Counter(map(_kind, scene.objects))
    return "; ".join(
        f"{count} {kind}" if count > 1 else kind
        for kind, count in sorted(counts.items())
    )


def signature(scene: Scene) -> Numbers:
    """Numbers of a scene, as many as of every scene of the same structure.

    Lengths count in metres and angles in half turns; gravity in 9.8 m/s^2; moduli,
    densities and their like by decades; velocities and rates by x / (1 + |x|), so that
    a difference of 0.05 is what a person calls near.

    Parameters
    ----------
    scene
        A scene.

    Returns
    -------
    ndarray of float64, shape (n,)
        Those of the surroundings, then those of each object, by kind and from left to
        right.
    """
    return np.concatenate([_surroundings(scene), *map(_numbers, _ordered(scene))])


def config_distance(one: Scene, other: Scene) -> float:
    """Mean absolute difference of two scenes' numbers, objects matched at their best.

    Parameters
    ----------
    one, other
        Scenes of any structures.

    Returns
    -------
    float
        0 for scenes that differ in names, colours and order only; infinite if their
        structures differ. [1]
    """
    if structure(one) != structure(other):
        return math.inf
    around = np.abs(_surroundings(one) - _surroundings(other))
    total, count = float(around.sum()), len(around)
    groups = zip(_groups(one), _groups(other), strict=True)
    for mine, theirs in groups:
        a, b = (np.array([_numbers(thing) for thing in g]) for g in (mine, theirs))
        costs = np.abs(a[:, None] - b[None]).sum(axis=2)
        total += _best_match(costs)
        count += a.size
    return total / count


def layout_image(scene: Scene, pixels: int = 128) -> Image:
    """What is where at the start: every outline filled with its colour, on black.

    Parameters
    ----------
    scene
        A scene.
    pixels
        Pixels along a side.

    Returns
    -------
    ndarray of uint8, shape (pixels, pixels, 3)
        RGB, top row first. Emitters, which hold nothing yet, are not drawn.
    """
    image = np.zeros((pixels, pixels, 3), np.uint8)
    for thing in scene.objects:
        if thing.object_type == "emitter":
            continue
        text = thing.visualization.color
        color = [int(text[i : i + 2], 16) for i in (1, 3, 5)]
        upside_down = [polygon * [1, -1] + [0, 1] for polygon in thing.shape.outline()]
        paint(image, upside_down, color, pixels)
    return image


def first_frame_distance(one: Scene, other: Scene, pixels: int = 64) -> float:
    """One less the intersection over union of what two scenes show at the start.

    Parameters
    ----------
    one, other
        Scenes.
    pixels
        Pixels along a side at which they are compared.

    Returns
    -------
    float
        In [0, 1]; 0 if the same pixels are covered, in whichever colours.
    """
    return view_distance(covered(one, pixels), covered(other, pixels))


def covered(scene: Scene, pixels: int) -> Mask:
    """Pixels (pixels, pixels) that objects of a scene cover at the start."""
    return np.asarray(layout_image(scene, pixels).any(axis=2))


def view_distance(a: Mask, b: Mask) -> float:
    """One less the intersection over union of covered pixels; 0 if there are none."""
    union = np.count_nonzero(a | b)
    return 1.0 - np.count_nonzero(a & b) / union if union else 0.0


def _kind(thing: Any) -> str:
    parts = [thing.object_type, thing.shape.type]
    if hasattr(thing, "physics_properties"):
        parts.append(thing.physics_properties.constitutive_model)
    for name in ("kinematics", "emission"):
        if hasattr(thing, name):
            parts.append(getattr(thing, name).type)
    return " ".join(parts)


def _ordered(scene: Scene) -> list[Any]:
    return sorted(scene.objects, key=lambda o: (_kind(o), *o.shape.center, o.name))


def _groups(scene: Scene) -> list[list[Any]]:
    """Objects of each kind."""
    return [list(group) for _, group in groupby(_ordered(scene), _kind)]


def _surroundings(scene: Scene) -> Numbers:
    walls = scene.environment.walls
    laws = [float(walls.contact == law) for law in LAWS]
    gravity = np.array(scene.environment.gravity) / 9.8
    return np.array([*gravity, *laws, _squashed(walls.friction)])


def _numbers(thing: Any) -> Numbers:
    """Numbers of an object; their count depends on its kind only."""
    corners = np.concatenate(thing.shape.outline())
    numbers = [*corners.min(0), *corners.max(0), *thing.shape.center]
    numbers += [math.sin(thing.shape.angle()), math.cos(thing.shape.angle())]
    if hasattr(thing, "physics_properties"):
        data = thing.physics_properties.model_dump()
        numbers += [
            _decades(data[key]) for key in sorted(data) if _is_number(data[key])
        ]
    for name in ("initial_state", "kinematics", "emission"):
        if hasattr(thing, name):
            numbers += _squashed_all(getattr(thing, name).model_dump())
    if hasattr(thing, "contact"):
        numbers += [float(thing.contact.type == law) for law in LAWS]
        numbers.append(_squashed(thing.contact.friction))
    return np.array(numbers)


def _squashed_all(data: dict[str, Any]) -> list[float]:
    numbers: list[float] = []
    for key in sorted(data):
        if key == "rate":  # of particles, so a matter of resolution
            continue
        values = data[key] if isinstance(data[key], tuple) else (data[key],)
        unit = 180.0 if key.endswith("_deg") else 1.0
        numbers += [_squashed(x / unit) for x in values if _is_number(x)]
    return numbers


def _is_number(value: object) -> bool:
    return isinstance(value, int | float)


def _squashed(x: float) -> float:
    return x / (1.0 + abs(x))


def _decades(x: float) -> float:
    """Decades of a parameter that is never negative; small ones count as they are."""
    return math.log10(1.0 + abs(x))


def _best_match(costs: Numbers) -> float:
    """Least sum of a matching of rows to columns; in order, if there are too many."""
    n = len(costs)
    if n > MOST_ALIKE:
        return float(np.trace(costs))
    rows = range(n)
    return min(
        float(sum(costs[i, j] for i, j in zip(rows, order, strict=True)))
        for order in permutations(rows)
    )
