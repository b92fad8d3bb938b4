"""Numbers that many scenes share exactly, tried where a scene is near to them.

Refinement comes near to such a number and stops a little aside of it, where other
numbers make up for that in the prefix but not after it.
"""

import copy
import math
from collections.abc import Iterator
from typing import Any, Final

from mpmworlds.baselines.search.prior import Prior
from mpmworlds.baselines.search.trials.moves import Doubt, aimed, pull, started

Data = dict[str, Any]

NEAR: Final = 2.0  # difference from a usual gravity [m/s^2]
SLOW: Final = 0.3  # speed of a body at first; hardly any that moves is slower [m/s]
DOWNWARD: Final = 10.0  # degrees from straight down; a third of all nozzles point there


def exact(data: Data, doubt: Doubt, prior: Prior) -> Iterator[tuple[str, Data]]:
    """Scenes that differ from one in such a number, and what each is called.

    Parameters
    ----------
    data
        Plain data of the scene.
    doubt
        What may be changed.
    prior
        What is usual.
    """
    yield from _gravities(data, doubt, prior)
    yield from _walls(data, doubt, prior)
    for number, thing in enumerate(data["objects"]):
        known = doubt.told.get(number, {})
        if "initial_state" in thing and number not in doubt.started:
            told = known.get("initial_state") or {}
            spins = thing["initial_state"]["angular_velocity"] != 0.0
            if spins and "angular_velocity" not in told:
                changed = started(data, number, angular_velocity=0.0)
                yield f"{number} does not spin", changed
            speed = math.hypot(*thing["initial_state"]["velocity"])
            if 0.0 < speed < SLOW and not told:
                rest = {"velocity": [0.0, 0.0], "angular_velocity": 0.0}
                yield f"{number} starts at rest", started(data, number, **rest)
        if "emission" in thing and "velocity" not in (known.get("emission") or {}):
            x, y = thing["emission"]["velocity"]
            aside = math.remainder(-math.pi / 2.0 - math.atan2(y, x), 2.0 * math.pi)
            if 0.0 < math.degrees(abs(aside)) < DOWNWARD:
                changed = copy.deepcopy(data)
                aimed(number)(changed, aside)
                yield f"{number} points straight down", changed


def _gravities(data: Data, doubt: Doubt, prior: Prior) -> Iterator[tuple[str, Data]]:
    own = data["environment"]["gravity"]
    for usual in prior.gravities if doubt.gravity else ():
        value = [float(g) for g in usual["value"]]
        if 0.0 < math.dist(own, value) < NEAR:
            changed = copy.deepcopy(data)
            for axis in (0, 1):
                pull(axis, doubt.flights)(changed, value[axis] - own[axis])
            changed["environment"]["gravity"] = value
            yield "a usual gravity", changed


def _walls(data: Data, doubt: Doubt, prior: Prior) -> Iterator[tuple[str, Data]]:
    changed = evened(data, prior)
    if doubt.walls and changed != data:
        yield "a usual friction of the walls", changed


def evened(data: Data, prior: Prior) -> Data:
    """A scene with the usual friction of walls that is nearest to its own."""
    changed = copy.deepcopy(data)
    walls = changed["environment"]["walls"]
    walls["friction"] = prior.usual_friction(walls)
    return changed
