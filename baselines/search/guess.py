"""What is seen and told, put together: each thing of a scene, before any simulation."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.matter import DRAWN
from mpmworlds.baselines.search.perception.colors import EXACT, Labels
from mpmworlds.baselines.search.perception.drops import flights_of_drops
from mpmworlds.baselines.search.perception.edges import Edge, edge_of
from mpmworlds.baselines.search.perception.flight import (
    EARTH,
    LONG,
    Flight,
    Gravity,
    flight_of,
    gravity_of,
)
from mpmworlds.baselines.search.perception.laws import Law, laws_of
from mpmworlds.baselines.search.perception.nozzles import Nozzle, nozzles_of
from mpmworlds.baselines.search.perception.pixels import GROWN, Pixels
from mpmworlds.baselines.search.perception.placing import place_shape
from mpmworlds.baselines.search.perception.poses import Poses, poses_of
from mpmworlds.baselines.search.perception.shapes import Fit, fit_shape
from mpmworlds.baselines.search.perception.tracks import Track, tracks_of
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.side import Told
from mpmworlds.sim.scene.objects import SHAPES

Data = dict[str, Any]

LAWFUL: Final = 0.8  # distance from a law of motion that is none [px]
FOLLOWED: Final = 0.94  # overlap of nearly all frames of what moves as a whole
LOST: Final = 0.03  # of the overlap at first, by a thing that is drawn less well
CALLS: Final = 1500  # free flights that a nozzle is fitted by
POLYGON: Final = "polygon"


@dataclass
class Thing:
    """A thing of the scene, as it is seen."""

    told: Mapping[str, Any]
    """What is known of it without looking."""
    track: Track | None
    """Where it is seen; None if it is not."""
    kind: str
    """Its object type."""
    fit: Fit | None = None
    """Its shape; None of nozzles."""
    poses: Poses | None = None
    """How it moves, while it keeps its shape."""
    laws: Sequence[Law] = ()
    """Laws of motion that explain it, likeliest first."""
    flight: Flight | None = None
    """How a body flies."""
    nozzles: Sequence[Nozzle] = ()
    """What it may come out of, likeliest first."""
    edge: Edge = Edge.UNCLEAR
    """How its edge looks, if it is a body."""


@dataclass
class Sight:
    """All that is seen."""

    things: list[Thing]
    """In the order of scenes: what stands, what moves, bodies, nozzles."""
    gravities: list[Gravity]
    """The likeliest first."""
    pixels: Pixels
    """Where pixels are."""
    frame_time: float
    """Simulated time between frames [s]."""
    labels: Labels = field(repr=False)
    """The frames."""


ORDER: Final = ("static_collider", "kinematic_collider", "dynamic_body", "emitter")


def look(
    labels: Labels, pixels: Pixels, frame_time: float, told: Told, seed: int
) -> Sight:
    """Find the things of labelled frames.

    Parameters
    ----------
    labels
        The prefix.
    pixels
        Where its pixels are.
    frame_time
        Simulated time between its frames [s].
    told
        What is known of the scene.
    seed
        Which draws.
    """
    things = [
        _thing(track, known, pixels, frame_time)
        for track, known in _paired(tracks_of(labels), told)
    ]
    for thing in things if labels.exact > EXACT else ():
        if thing.kind == "dynamic_body" and thing.track is not None:
            thing.edge = _edge(thing, thing.track, pixels)
    gravities = _gravities(things, pixels, frame_time, told)
    for thing in things:
        aim(thing, gravities[0].value, pixels, frame_time, seed)
    if not told.anything:
        things.sort(key=lambda thing: ORDER.index(thing.kind))
    return Sight(things, gravities, pixels, frame_time, labels)


def aim(
    thing: Thing,
    gravity: tuple[float, float],
    pixels: Pixels,
    frame_time: float,
    seed: int,
    calls: int = CALLS,
) -> None:
    """Fit what depends on gravity: the flight of a body, the nozzle of a jet."""
    if thing.kind == "dynamic_body" and thing.poses is not None:
        thing.flight = flight_of(thing.poses, gravity, frame_time, pixels.side)
    if thing.kind == "emitter" and thing.track is not None:
        thing.nozzles = nozzles_of(
            thing.track, pixels, gravity, frame_time, calls, seed, thing.told
        )


def _paired(
    tracks: Sequence[Track], told: Told
) -> list[tuple[Track | None, Mapping[str, Any]]]:
    """Tracks with what is known of their things, in the order that is told."""
    if not told.anything:
        return [(track, {}) for track in tracks]
    left = list(tracks)
    found: list[tuple[Track | None, Mapping[str, Any]]] = []
    for known in told.objects:
        color = known["visualization"]["color"]
        late = known.get("object_type") == "emitter"
        alike = [t for t in left if t.color == color and t.late == late]
        alike = alike or [t for t in left if t.color == color]
        track = min(alike, key=lambda t: _apart(t, known, told), default=None)
        left = [t for t in left if t is not track]
        found.append((track, known))
    return found


def _apart(track: Track, known: Mapping[str, Any], told: Told) -> float:
    """How far a track is from where a thing is said to be."""
    place = (known.get("shape") or {}).get("center") or told.near.get(known["name"])
    if place is None:
        return 0.0
    rows, columns = np.nonzero(track.masks[track.first])
    side = track.masks.shape[1]
    x, y = columns.mean() / side, 1.0 - rows.mean() / side
    return math.hypot(x - place[0], y - place[1])


def _thing(
    track: Track | None,
    known: Mapping[str, Any],
    pixels: Pixels,
    frame_time: float,
) -> Thing:
    kind = known.get("object_type")
    if track is None or track.late:
        return Thing(known, track, kind or "emitter")
    if kind == "emitter":  # of the colour of something that is there at first
        return Thing(known, None, kind)
    guess = kind or ("static_collider" if track.stays else "")
    if guess == "static_collider":
        return Thing(known, track, guess, _shape(track, known, pixels, 0.0))
    grown = {"dynamic_body": GROWN, "kinematic_collider": 0.0}.get(guess, GROWN / 2)
    fit = _shape(track, known, pixels, grown)
    poses = poses_of(track, fit.shape, pixels, grown)
    laws: Sequence[Law] = ()
    if guess != "dynamic_body" and len(poses) > 4:
        reach = SHAPES[fit.shape["type"]].model_validate(fit.shape).reach()
        laws = laws_of(poses, frame_time, reach, pixels.side)
    if not guess:
        followed = len(poses) == len(track.masks)
        least = min(FOLLOWED, fit.iou - LOST)
        followed = followed and float(np.quantile(poses.iou, 0.1)) > least
        lawful = bool(laws) and laws[0].error < LAWFUL
        guess = "kinematic_collider" if followed and lawful else "dynamic_body"
        fit = _shape(track, known, pixels, GROWN if guess == "dynamic_body" else 0.0)
    return Thing(known, track, guess, fit, poses, laws)


def _shape(
    track: Track,
    known: Mapping[str, Any],
    pixels: Pixels,
    grown: float,
    *kinds: str,
) -> Fit:
    shape = dict(known.get("shape") or {})
    mask, care = track.masks[0], track.care(0)
    if "center" in shape:
        return Fit(shape, 1.0)
    if len(shape) > 1:
        return place_shape(mask, pixels, shape, grown, care)
    asked = [shape["type"]] if shape else kinds
    return fit_shape(mask, pixels, grown, care, asked, prior().outlines)


def _edge(thing: Thing, track: Track, pixels: Pixels) -> Edge:
    """How the edge of a body looks when it is seen first."""
    if thing.fit is None:
        return Edge.UNCLEAR
    shapes = [thing.fit.shape]
    if shapes[0]["type"] == POLYGON:  # drawn larger, it is no scaled one
        grown = DRAWN["elastic_fem"]
        shapes.append(_shape(track, thing.told, pixels, grown, POLYGON).shape)
    return edge_of(track.masks[0], track.care(0), pixels, *shapes)


def _gravities(
    things: Sequence[Thing], pixels: Pixels, frame_time: float, told: Told
) -> list[Gravity]:
    if "gravity" in told.environment:
        x, y = told.environment["gravity"]
        return [Gravity((float(x), float(y)), sure=True)]
    flying = [
        thing.poses
        for thing in things
        if thing.kind == "dynamic_body" and thing.poses is not None
    ]
    found = gravity_of(flying, frame_time, pixels.side)
    if not found[0].sure:
        drops = [
            flight
            for thing in things
            if thing.kind == "emitter" and thing.track is not None
            for flight in flights_of_drops(thing.track.masks, pixels)
        ]
        if len(drops) >= 2 or any(len(drop) >= LONG for drop in drops):
            told_by = gravity_of(drops, frame_time, pixels.side, near=0.7)
            if told_by[0].sure or found[0].value == EARTH:
                found = told_by
    pulls = told.pulls
    if pulls is None:
        return found
    agreeing = [g for g in found if _signs(g.value) == pulls]
    return agreeing or [Gravity(_custom(pulls), sure=False)]


def _signs(v: Sequence[float]) -> tuple[int, int]:
    return (v[0] > 0) - (v[0] < 0), (v[1] > 0) - (v[1] < 0)


def _custom(pulls: tuple[int, int]) -> tuple[float, float]:
    """Gravity of usual strength in a direction of which signs are told."""
    if pulls == (0, -1):
        return EARTH
    return 2.2 * pulls[0], 5.8 * pulls[1]
