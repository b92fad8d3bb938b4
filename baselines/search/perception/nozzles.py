"""Nozzles: place, direction, speed, rate, width and kind, from free flight."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.drops import Drops, all_drops_of, drops_of
from mpmworlds.baselines.search.perception.evolution import evolve
from mpmworlds.baselines.search.perception.flow import Flow, Hit
from mpmworlds.baselines.search.perception.pixels import WALL, Pixels
from mpmworlds.baselines.search.perception.starts import Starts
from mpmworlds.baselines.search.perception.tracks import Track
from mpmworlds.baselines.search.perception.usual_nozzles import unusual

Floats = npt.NDArray[np.float64]
Data = dict[str, Any]

MOST_FRAMES: Final = 9  # that a fit compares
LONGEST: Final = 26  # frames that count at most
DEPTH: Final = 0.04  # of a nozzle along its jet, which does nothing [m]
NO_DROPS: Final = 10.0  # better fit that a jet must be worth where drops are seen
CLEARLY: Final = 0.7  # part of a misfit that another look at drops must leave at most
HOSE_HANDICAP: Final = 0.03  # better fit that a swing must be worth
# A misfit of other kinds after which a kind is not tried.
GOOD: Final = {"jet": 1.5, "rain": 0.3, "hose": 0.1}
NAMES: Final = ("x", "y", "speed", "heading", "rate", "width", "start")
MORE: Final = {"jet": (), "rain": ("radius",), "hose": ("swing", "period")}
FINER: Final = 0.4  # steps of what drops tell well
STEPS: Final = {
    "x": 0.02,
    "y": 0.02,
    "speed": 0.3,
    "heading": 0.2,
    "rate": 0.25,
    "width": 0.3,
    "start": 0.012,
    "radius": 0.1,
    "swing": 12.0,
    "period": 0.2,
}


@dataclass(frozen=True)
class Nozzle:
    """A nozzle that explains what is seen of a thing that was not there at first."""

    shape: Data
    """Box, plain data."""
    emission: Data
    """Plain data, without a stop."""
    error: float
    """Misfit of its free flight, see `Flow.misfit`."""


def nozzles_of(
    track: Track,
    pixels: Pixels,
    gravity: Sequence[float],
    frame_time: float,
    calls: int,
    seed: int,
    told: Mapping[str, Any],
) -> list[Nozzle]:
    """Nozzles of each kind, the likeliest first.

    Parameters
    ----------
    track
        What comes out.
    pixels
        Where its pixels are.
    gravity
        [m/s^2].
    frame_time
        Simulated time between frames [s].
    calls
        Free flights to try for each kind.
    seed
        Which draws.
    told
        What is known of it: plain data of an emitter with gaps.
    """
    hit = Hit.of(track.masks, track.hidden, pixels, gravity)
    flows = {
        kind: Flow(track.masks, track.hidden, frames, pixels, frame_time, hit)
        for kind, frames in _frames(track, hit).items()
    }
    drops = drops_of(track.masks, pixels, gravity, frame_time, hit)
    known = dict(told.get("emission") or {})
    kinds = [known["type"]] if "type" in known else _kinds(drops)
    start = Starts(track, pixels, gravity, frame_time, drops, told)
    found: dict[str, tuple[float, dict[str, float]]] = {}

    def fit(kind: str, starts: Sequence[Mapping[str, float]]) -> None:
        for one in starts:
            locked, flow = start.locked_of(one), flows[kind]
            fitted = _fitted(kind, one, locked, flow, gravity, calls, seed)
            found[kind] = min(found.get(kind, fitted), fitted, key=lambda f: f[0])

    for kind in kinds:
        if found and min(error for error, _ in found.values()) < GOOD[kind]:
            break
        fit(kind, start.of(kind))
        if kind == "hose" and "jet" in found:  # may have begun far off
            fit("jet", [found["hose"][1]])
        if kind == "rain" and found[kind][0] > GOOD[kind]:
            others = all_drops_of(track.masks, pixels, gravity, frame_time)
            if others is not None and others != drops:
                before = found.pop(kind)
                fit(kind, start.of_drops(others))
                if found[kind][0] > CLEARLY * before[0]:  # both may be of a heap
                    found[kind] = before
    nozzles = [_finished(kind, x, error) for kind, (error, x) in found.items()]
    return sorted(nozzles, key=lambda n: n.error + _handicap(n, kinds[0]))


def _handicap(nozzle: Nozzle, likeliest: str) -> float:
    """Misfit that makes up for a kind that is not the likeliest."""
    kind = nozzle.emission["type"]
    if likeliest == "rain" and kind != likeliest:
        return NO_DROPS
    return HOSE_HANDICAP if kind == "hose" and likeliest != kind else 0.0


def _fitted(
    kind: str,
    start: Mapping[str, float],
    locked: Collection[str],
    flow: Flow,
    gravity: Sequence[float],
    calls: int,
    seed: int,
) -> tuple[float, dict[str, float]]:
    """Least misfit of a kind near to some numbers, and the numbers that have it."""
    names = [n for n in (*NAMES, *MORE[kind]) if n not in locked]

    def changed(x: Floats) -> dict[str, float]:
        return dict(start) | dict(zip(names, map(float, x), strict=True))

    def cost(x: Floats) -> float:
        trial = changed(x)
        return flow.misfit(_nozzle(kind, trial), gravity) + unusual(kind, trial)

    finer = FINER if kind == "rain" else 1.0
    error, x = evolve(
        cost,
        [start[n] for n in names],
        [STEPS[n] * finer for n in names],
        calls,
        seed,
    )
    return error, changed(x)


def _kinds(drops: Drops | None) -> list[str]:
    steady = drops is not None and drops.steady
    return ["rain", "jet"] if steady else ["jet", "hose", "rain"]


def _frames(track: Track, hit: Hit) -> dict[str, list[int]]:
    """Frames that count for each kind: of a jet those before it hits anything."""
    first, last = track.first, len(track.masks) - 1
    until = {
        "jet": min(max(hit.frame, first + 2), first + 8, last),
        "hose": min(max(hit.frame, first + 4), first + LONGEST, last),
        "rain": min(first + LONGEST, last),
    }
    found = {}
    for kind, end in until.items():
        picked = np.linspace(max(first - 1, 0), end, min(MOST_FRAMES, end - first + 2))
        found[kind] = sorted({round(float(k)) for k in picked} | {first})
    return found


def _nozzle(kind: str, v: Mapping[str, float]) -> Data:
    radius = min(max(math.exp(v.get("radius", -4.0)), 0.004), 0.12)
    width = min(max(math.exp(v["width"]), 0.012), 0.9)
    speed = max(abs(v["speed"]), 0.06)
    emission: Data = {
        "type": kind,
        "rate": min(max(math.exp(v["rate"]), 50.0), 60_000.0),
        "velocity": [speed * math.cos(v["heading"]), speed * math.sin(v["heading"])],
        "start": max(v["start"], 0.0),
    }
    if kind == "rain":
        emission["drop_radius"] = radius
        width = max(width, 2.0 * radius + 1e-4)
    if kind == "hose":
        emission["swing_deg"] = min(max(v["swing"], -80.0), 80.0)
        emission["period"] = max(v["period"], 0.1)
    center = _inside(v["x"], v["y"], width, v["heading"])
    return {"center": center, "width": width, "emission": emission}


def _inside(x: float, y: float, width: float, heading: float) -> list[float]:
    """Place of a nozzle that lies within the walls, near to one that may not."""
    ahead = np.abs([math.cos(heading), math.sin(heading)])
    reach = np.minimum(WALL + 0.5 * (DEPTH * ahead + width * ahead[::-1]), 0.5)
    found: list[float] = np.clip([x, y], reach, 1.0 - reach).tolist()
    return found


def _finished(kind: str, numbers: Mapping[str, float], error: float) -> Nozzle:
    found = _nozzle(kind, numbers)
    shape = {
        "type": "box",
        "center": found["center"],
        "angle_deg": math.remainder(math.degrees(numbers["heading"]) - 90.0, 360.0),
        "size": [found["width"], DEPTH],
    }
    return Nozzle(shape, found["emission"], error)
