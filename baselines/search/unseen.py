"""What comes after the prefix: scenes that differ in nothing that it shows."""

import copy
from collections.abc import Iterator
from typing import Any, Final

from mpmworlds.baselines.search.prior import LATEST, QUARTILES, Prior
from mpmworlds.baselines.search.trials.readings import Trial
from mpmworlds.baselines.search.trials.search import Search

Data = dict[str, Any]

AS_GOOD: Final = 1.2  # loss over the best one's of a scene that is as likely


def proposals(search: Search, prior: Prior, end: float, count: int) -> list[Trial]:
    """Scenes to answer with, by the losses of their prefixes, the best first.

    Readings that are about as good as the best one come first, then what the best one
    leaves open, then worse readings; more than `count`, for some may not be valid.

    Parameters
    ----------
    search
        All that was tried.
    prior
        What is usual.
    end
        Time at the end of the prefix [s].
    count
        How many are wanted.
    """
    best, *others = search.candidates(3 * count)
    near = [trial for trial in others if trial.loss < AS_GOOD * best.loss]
    far = [trial for trial in others if trial.loss >= AS_GOOD * best.loss]
    open_ = [Trial(best.loss, d, what) for what, d in variants(best.data, prior, end)]
    return [best, *_in_turn(near, open_), *far]


def _in_turn(one: list[Trial], other: list[Trial]) -> Iterator[Trial]:
    for k in range(max(len(one), len(other))):
        yield from (*one[k : k + 1], *other[k : k + 1])


def variants(data: Data, prior: Prior, end: float) -> Iterator[tuple[str, Data]]:
    """What becomes of a scene where motions lead less or more far, jets stop otherwise.

    Parameters
    ----------
    data
        Plain data of a scene.
    prior
        Ways and stops of the train split.
    end
        Time at the end of the prefix [s].
    """
    for place, word in ((2, "more"), (0, "less")):
        changed = copy.deepcopy(data)
        for thing in changed["objects"]:
            _lead(thing, prior, QUARTILES[place], end)
            _pour(thing, prior, place, end)
        if changed != data:
            yield f"goes on for {word} time", changed


def _lead(thing: Data, prior: Prior, part: float, end: float) -> None:
    motion = thing.get("kinematics", {})
    if motion.get("type") != "translate" or motion["stop"] <= end:
        return
    motion["stop"] = prior.stop(motion, end, part)


def _pour(thing: Data, prior: Prior, place: int, end: float) -> None:
    emission = thing.get("emission", {})
    if emission.get("stop", 0.0) > end:
        stops = prior.emission_stops[emission["type"]]
        emission["stop"] = max(stops[place], end + LATEST)
