"""From a prefix to scenes: look, assemble, search; and what is believed."""

import copy
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.assembly import scene_data
from mpmworlds.baselines.search.guess import Sight, Thing, aim, look
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.perception.flight import (
    LEAST,
    LONG,
    RIGID,
    SAME,
    Flight,
    Gravity,
    flight_of,
)
from mpmworlds.baselines.search.perception.nozzles import Nozzle
from mpmworlds.baselines.search.perception.pixels import Pixels, around
from mpmworlds.baselines.search.prior import Prior, prior
from mpmworlds.baselines.search.repair import written
from mpmworlds.baselines.search.side import Told
from mpmworlds.baselines.search.trials.lab import Lab
from mpmworlds.baselines.search.trials.moves import Doubt
from mpmworlds.baselines.search.trials.readings import Trial
from mpmworlds.baselines.search.trials.search import Search
from mpmworlds.baselines.search.trials.tried import Known, Tried
from mpmworlds.baselines.search.unseen import proposals
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import FRAMERATE, Frames

Data = dict[str, Any]

RIVAL_NOZZLE: Final = 2.5  # misfit over the best one's of a nozzle that is tried, too
RIVAL_LAW: Final = 0.4  # distance over the best one's of a law that is tried, too [px]
# Gravities tried where flights tell none, evenly among the unusual ones [m/s^2]: these
# are of 3 to 9.5, up to 40 degrees aside.
UNUSUAL: Final = tuple(
    (side * aside, down)
    for aside, down in ((0.9, -4.4), (2.1, -4.0), (1.6, -7.3), (3.5, -6.6))
    for side in (-1.0, 1.0)
)
FEWER_CALLS: Final = 350  # free flights that nozzles are fitted by under these
SEEN: Final = 2  # frames after which a body that starts at rest is known to
APART: Final = 2  # pixels between things that do not touch yet
NEAR: Final = 4  # pixels from matter within which things are touched


@dataclass(frozen=True)
class Budget:
    """What a search may take."""

    runs: int = 800
    """Runs of the prefix."""
    minutes: float = 4.0
    """Estimated minutes of one core that these runs take."""


@dataclass(frozen=True)
class Found:
    """What a search came to."""

    scenes: tuple[str, ...]
    """Scene files, the likeliest first."""
    trials: tuple[Trial, ...]
    """How they came about."""
    search: Search
    """All that was tried."""
    sight: Sight
    """What was seen."""


def infer(
    prefix: Frames,
    framerate: int,
    form: VideoForm,
    told: Told,
    budget: Budget,
    candidates: int,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Found:
    """Find scenes that draw a prefix.

    Parameters
    ----------
    prefix
        uint8 (T, N, N, 3), RGB, as it is evaluated.
    framerate
        Its frames per second [1/s].
    form
        Of the video that scenes are to draw.
    told
        What is known of the scene.
    budget
        What the search may take.
    candidates
        Largest number of scenes.
    seed
        Which draws.
    progress
        Called with the share of the budget that is spent, now and then.

    Raises
    ------
    ValueError
        If there is nothing in the prefix that scenes have, or nothing of matter.
    """
    usual = prior()
    labels = labels_of(prefix)
    pixels = Pixels.of(prefix.shape[1], form.pixels)
    rate = min(framerate, FRAMERATE)
    sight = look(labels, pixels, usual.frame_time / rate, told, seed)
    scenes = list(_readings(sight, told, form, usual, seed))
    if not any("physics_properties" in t for t in scenes[0]["objects"]):
        raise ValueError(
            "nothing that moves like matter is seen, so there is nothing to simulate"
        )
    far = list(_far_gravities(sight, told, form, usual, seed))
    with Lab(labels, form, budget.runs, 60.0 * budget.minutes, progress) as lab:
        search = Search(Tried(lab, usual, _known(sight, told)), seed)
        search.run(scenes, far)
    end = sight.frame_time * (len(labels.numbers) - 1)
    trials, texts = _answers(search, usual, end, candidates)
    return Found(tuple(texts), tuple(trials), search, sight)


def _answers(
    search: Search, usual: Prior, end: float, count: int
) -> tuple[list[Trial], list[str]]:
    """Trials to answer with, the best first, and their scene files."""
    found: list[tuple[Trial, str]] = []
    for trial in proposals(search, usual, end, count):
        try:
            found.append((trial, written(trial.data)))
        except ValueError:
            continue
        if len(found) == count:
            break
    if not found:
        found = [(search.best, written(search.best.data))]  # says what is wrong
    found.sort(key=lambda pair: pair[0].loss)
    return [trial for trial, _ in found], [text for _, text in found]


def _readings(
    sight: Sight, told: Told, form: VideoForm, usual: Prior, seed: int
) -> Iterator[Data]:
    """Scenes that the prefix may be of, the likeliest first."""
    first = sight.gravities[0]
    yield scene_data(sight, told, form, usual, first.value)
    for thing in sight.things:
        for rival in _rivals(thing):
            swapped = copy.copy(sight)
            swapped.things = [rival if t is thing else t for t in sight.things]
            yield scene_data(swapped, told, form, usual, first.value)
    if not _gravity_is_open(sight, told):
        return
    customary = [tuple(g["value"]) for g in usual.gravities]
    others = [g.value for g in sight.gravities[1:]] + customary
    for gravity in dict.fromkeys(others):
        if gravity != first.value:
            turned = _under(gravity, sight, seed)
            yield scene_data(turned, told, form, usual, gravity)


def _gravity_is_open(sight: Sight, told: Told) -> bool:
    """Whether neither flights nor a caption tell gravity."""
    return not sight.gravities[0].sure and told.pulls is None


def _far_gravities(
    sight: Sight, told: Told, form: VideoForm, usual: Prior, seed: int
) -> Iterator[Data]:
    """Scenes of gravities that neither are usual nor seen, where none is seen."""
    if not _gravity_is_open(sight, told):
        return
    for gravity in UNUSUAL:
        turned = _under(gravity, sight, seed)
        if _pours_as_well(turned, sight):
            yield scene_data(turned, told, form, usual, gravity)


def _under(gravity: tuple[float, float], sight: Sight, seed: int) -> Sight:
    """What is seen, explained by another gravity."""
    turned = copy.copy(sight)
    turned.things = [copy.copy(thing) for thing in sight.things]
    for thing in turned.things:
        aim(thing, gravity, sight.pixels, sight.frame_time, seed, FEWER_CALLS)
    return turned


def _pours_as_well(one: Sight, other: Sight) -> bool:
    """Whether nozzles explain what is seen about as well under another gravity."""
    return all(
        _as_well(a.nozzles[0], b.nozzles[0])
        for a, b in zip(one.things, other.things, strict=True)
        if a.nozzles and b.nozzles
    )


def _as_well(one: Nozzle, other: Nozzle) -> bool:
    """Whether a nozzle explains what is seen about as well as another one."""
    return one.error < RIVAL_NOZZLE * other.error + 0.05


def _rivals(thing: Thing) -> Iterator[Thing]:
    """The thing with another nozzle or law, if that explains it nearly as well."""
    for nozzle in thing.nozzles[1:]:
        if _as_well(nozzle, thing.nozzles[0]):
            other = copy.copy(thing)
            other.nozzles = [nozzle, *(n for n in thing.nozzles if n is not nozzle)]
            yield other
    if thing.kind == "kinematic_collider" and len(thing.laws) > 1:
        best, next_ = thing.laws[:2]
        if next_.error < best.error + RIVAL_LAW:
            other = copy.copy(thing)
            other.laws = [next_, best]
            yield other


def _known(sight: Sight, told: Told) -> Known:
    contacts, flights, started, longest = {}, {}, [], 0
    edges = {number: thing.edge for number, thing in enumerate(sight.things)}
    for number, thing in enumerate(sight.things):
        if thing.kind == "dynamic_body" and thing.poses is not None:
            contacts[number] = thing.poses.rigid(RIGID)
            flight = _surest_flight(thing, sight)
            if flight.frames >= SEEN:
                longest = max(longest, flight.frames)
                if flight.frames > LEAST:
                    flights[number] = sight.frame_time * (flight.frames - 1)
                if flight.frames >= (LONG if any(flight.velocity) else SEEN):
                    started.append(number)
        if thing.kind == "emitter" and thing.track is not None:
            contacts[number] = thing.track.first + 8
    doubt = Doubt(
        told={k: thing.told for k, thing in enumerate(sight.things)},
        flights=flights,
        started=started,
        gravity=_doubted(sight.gravities[0], told, longest),
        walls="walls" not in told.environment,
    )
    first = sight.gravities[0]
    seen = first.value if first.sure else None
    alone = alone_until(sight.things)
    return Known(doubt, seen, contacts, _touched(sight.things), alone, edges)


def _surest_flight(thing: Thing, sight: Sight) -> Flight:
    """The flight of a body, the shortest one under any gravity that may be."""
    assert thing.poses is not None and thing.flight is not None
    first, *others = sight.gravities
    flights = [
        flight_of(thing.poses, g.value, sight.frame_time, sight.pixels.side)
        for g in ([] if first.sure else others)
    ]
    return min([thing.flight, *flights], key=lambda flight: flight.frames)


def alone_until(things: Sequence[Thing]) -> dict[int, int]:
    """Frames until two things of matter come near to each other, by their numbers."""
    matter = {
        number: thing.track.masks
        for number, thing in enumerate(things)
        if thing.track is not None and thing.kind in ("dynamic_body", "emitter")
    }
    near = {
        number: np.stack([around(mask, APART) for mask in masks])
        for number, masks in matter.items()
    }
    found: dict[int, int] = {}
    for pair in combinations(matter, 2):
        one, other = pair
        touch: npt.NDArray[np.bool_] = np.any(matter[one] & near[other], axis=(1, 2))
        if touch.any():
            for number in pair:
                found[number] = min(found.get(number, len(touch)), int(touch.argmax()))
    return found


def _doubted(seen: Gravity, told: Told, longest: int) -> Sequence[int]:
    """Axes along which gravity may be a little different."""
    certain = seen.sure and (seen.value in SAME or longest >= LONG)
    if "gravity" in told.environment or certain:
        return ()
    signs = told.pulls or (1, 1)
    return [axis for axis in (1, 0) if signs[axis]]


def _touched(things: Sequence[Thing]) -> list[int]:
    matter = [
        thing.track.masks
        for thing in things
        if thing.track is not None and thing.kind in ("dynamic_body", "emitter")
    ]
    if not matter:
        return []
    near = [around(mask, NEAR) for mask in np.any(matter, axis=0)]
    return [
        number
        for number, thing in enumerate(things)
        if thing.kind in ("static_collider", "kinematic_collider")
        and thing.track is not None
        and any(
            bool((mask & close).any())
            for mask, close in zip(thing.track.masks, near, strict=True)
        )
    ]
