"""Find a place for an object in a scene, by rejection."""

import numpy as np

from mpmworlds.builder.recipes.objects import Data, NoRoomError, is_matter, rounded
from mpmworlds.sim.scene.scene import Scene, SceneError

TRIES = 24  # places tried for an object
NEAR = 0.6  # share of the places that are above or below another object
LOWEST, HIGHEST = 0.08, 0.92  # of centers [m]


def place(rng: np.random.Generator, scene: Data, thing: Data) -> None:
    """Add an object to a scene where it has room, in place.

    Matter tends to be put above something, and a collider below something, so that
    they meet.

    Parameters
    ----------
    rng
        Source of places.
    scene
        Plain data of a scene that is valid once it holds this object.
    thing
        Plain data of the object; its center is set.

    Raises
    ------
    NoRoomError
        If none of `TRIES` places is valid.
    """
    others, fault = scene["objects"], ""
    for _ in range(TRIES):
        thing["shape"]["center"] = _center(rng, thing, others)
        try:
            Scene.from_data(scene | {"objects": [*others, thing]})
        except SceneError as error:
            fault = str(error).splitlines()[0]
            continue
        others.append(thing)
        return
    raise NoRoomError(f"no room for {thing['name']} ({fault})")


def _center(rng: np.random.Generator, thing: Data, others: list[Data]) -> list[float]:
    if others and rng.uniform() < NEAR:
        x, y = others[rng.integers(len(others))]["shape"]["center"]
        up = 1.0 if is_matter(thing) else -1.0
        spot = x + rng.uniform(-0.15, 0.15), y + up * rng.uniform(0.08, 0.45)
    else:
        spot = rng.uniform(LOWEST, HIGHEST), rng.uniform(LOWEST, HIGHEST)
    return [rounded(min(max(float(s), LOWEST), HIGHEST)) for s in spot]
