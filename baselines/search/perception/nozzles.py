"""Nozzles: place, direction, speed, rate, width and kind, from free flight."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.drops import Drops, all_drops_of, drops_of
from mpmworlds.baselines.search.perception.evolution import evolve
from mpmworlds.baselines.search.perception.flow import SPACING, Flow, Hit
from mpmworlds.baselines.search.perception.order import numbered, spread
from mpmworlds.baselines.search.perception.pixels import Pixels
from mpmworlds.baselines.search.perception.tracks import Track

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Data = dict[str, Any]

MOST_FRAMES: Final = 9  # that a fit compares
LONGEST: Final = 26  # frames that count at most
DENSE: Final = 0.85  # of the densest jet: how dense most are
# How dense most are, and the deviation of its logarithm, in the train split.
USUAL: Final = {
    "jet": (DENSE, 0.18),
    "hose": (DENSE, 0.18),
    "rain": (0.058, 0.3),
    "drizzle": (0.21, 0.3),
}
DRIZZLE: Final = 0.5  # speed below which rain is narrow and dense [m/s]
# Misfit that one is worth which is so much denser, or less.
CROWDED: Final = {"jet": 0.01, "hose": 0.01, "rain": 0.001}
# Widths [m] and the deviations of their logarithms.
WIDE: Final = {"rain": (0.39, 0.3), "drizzle": (0.13, 0.25)}
NARROW: Final = 0.02  # between the outermost drops of a nozzle, at least [m]
SWING: Final = (24.0, 6.0)  # of hoses and its deviation [deg]
DEPTH: Final = 0.04  # of a nozzle along its jet, which does nothing [m]
# Start of rain [s] before which most is meant to start with the scene, hardly any not.
AT_ONCE: Final = 0.12
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
    start = _Start(track, pixels, gravity, frame_time, drops, told)
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
        return flow.misfit(_nozzle(kind, trial), gravity) + _unusual(kind, trial)

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


class _Start:
    """Where fits start."""

    def __init__(
        self,
        track: Track,
        pixels: Pixels,
        gravity: Sequence[float],
        frame_time: float,
        drops: Drops | None,
        told: Mapping[str, Any],
    ) -> None:
        self._masks, self._pixels, self._drops = track.masks, pixels, drops
        self._g, self._frame = np.asarray(gravity, np.float64), frame_time
        self._first = track.first
        self._told = _numbers_told(told)

    def of(self, kind: str) -> list[dict[str, float]]:
        """Numbers to start a kind with."""
        if kind == "rain" and self._drops is not None:
            return self.of_drops(self._drops)
        plain = self._of_growth() | self._told
        if kind == "rain":
            return [plain | {"radius": math.log(0.02), "width": math.log(0.15)}]
        if kind == "hose":
            swings = {"period": 1.1}
            both = [plain | {"swing": s * 22.0} | swings for s in (1, -1)]
            return [numbers | self._told for numbers in both][
                : 2 - ("swing" in self._told)
            ]
        return [plain]

    def locked_of(self, numbers: Mapping[str, float]) -> set[str]:
        """Numbers that are known: those that are told, and a start with the scene.

        That of rain trades with its speed and place.
        """
        at_once = "radius" in numbers and numbers["start"] == 0.0
        return {*self._told, *(["start"] if at_once else [])}

    def _of_growth(self) -> dict[str, float]:
        """From how the middle moves and the area grows in the first frames."""
        early = range(self._first, min(self._first + 4, len(self._masks)))
        a, b = self._masks[early[0]], self._masks[early[-1]]
        start, end = self._pixels.centroid(a), self._pixels.centroid(b)
        time = max((early[-1] - early[0]) * self._frame, self._frame)
        # The middle of a jet that grows moves at half the speed of its head.
        velocity = 2.0 * (end - start) / time - self._g * time / 3.0
        speed = min(max(float(np.hypot(*velocity)), 0.3), 6.0)
        heading = math.atan2(velocity[1], velocity[0])
        across = np.array([-math.sin(heading), math.cos(heading)])
        places = self._pixels.places(*np.nonzero(b))
        width = max(float(np.ptp(places @ across)), 0.015)
        back = velocity / max(speed, 1e-6)
        along = (self._pixels.places(*np.nonzero(a)) - start) @ back
        origin = start + back * float(along.min())
        return {
            "x": float(origin[0]),
            "y": float(origin[1]),
            "speed": speed,
            "heading": heading,
            "rate": math.log(DENSE * width * speed / SPACING**2),
            "width": math.log(width),
            "start": max((self._first - 0.7) * self._frame, 0.0),
        }

    def of_drops(self, drops: Drops) -> list[dict[str, float]]:
        """From the order of drops; one alone tells no width, which may be either."""
        widths = [width for width, _ in WIDE.values()]
        alone = len(drops.births) == 1 and "width" not in self._told
        return [
            self._of_order(drops, width) for width in widths[: None if alone else 1]
        ]

    def _of_order(self, drops: Drops, usual: float) -> dict[str, float]:
        """From the order of drops: each is a golden step aside from the one before."""
        velocity = np.array(drops.velocity)
        speed = max(float(np.hypot(*velocity)), 0.1)
        ahead = velocity / speed
        across = np.array([-ahead[1], ahead[0]])
        seen = np.array([birth[0] for birth in drops.births])
        places = np.array([birth[1:] for birth in drops.births])
        along = places @ ahead
        # Drops are born in the frame before the one that shows them first.
        level = 0.5 * (along.max() - speed * self._frame + along.min())
        born = seen - np.clip((along - level) / speed, 0.0, self._frame)
        side = places @ across
        numbers, gap = numbered(born, side, len(self._masks) * self._frame)
        start = float(np.mean(born - gap * (numbers + 0.5)))
        if "start" in self._told or start < AT_ONCE:
            level -= speed * (self._told.get("start", 0.0) - start)
            start = self._told.get("start", 0.0)
        middle, width = spread(side, numbers, max(usual - 2 * drops.radius, NARROW))
        center = level * ahead + middle * across
        count = max(round(math.pi * (drops.radius / SPACING) ** 2), 1)
        return {
            "x": float(center[0]),
            "y": float(center[1]),
            "speed": speed,
            "heading": math.atan2(velocity[1], velocity[0]),
            "rate": math.log(count / gap),
            "width": math.log(width + 2 * drops.radius),
            "start": start,
            "radius": math.log(max(drops.radius, 0.004)),
        } | self._told


def _unusual(kind: str, v: Mapping[str, float]) -> float:
    """Misfit that makes up for how unusually dense or narrow one is."""
    speed = max(abs(v["speed"]), 0.06)
    deviations = crowding(kind, math.exp(v["rate"]), math.exp(v["width"]), speed) ** 2
    if kind == "rain":
        usual, spread = WIDE[_sort(kind, speed)]
        deviations += ((v["width"] - math.log(usual)) / spread) ** 2
    if kind == "hose":
        usual, spread = SWING
        deviations += ((abs(v["swing"]) - usual) / spread) ** 2
    return CROWDED[kind] * deviations


def _sort(kind: str, speed: float) -> str:
    """Kind of a nozzle, or `drizzle`: slow rain is of another width and density."""
    return "drizzle" if kind == "rain" and speed < DRIZZLE else kind


def crowding(kind: str, rate: float, width: float, speed: float) -> float:
    """How much denser than most of its kind one is, in standard deviations.

    Rate [1/s], width [m] and speed [m/s] trade against each other in what is seen.
    """
    usual, spread = USUAL[_sort(kind, speed)]
    return math.log(rate * SPACING**2 / (usual * width * speed)) / spread


def _numbers_told(told: Mapping[str, Any]) -> dict[str, float]:
    """What is known of the numbers of a nozzle."""
    emission, shape = told.get("emission") or {}, told.get("shape") or {}
    found: dict[str, float] = {}
    logs = {"rate": "rate", "drop_radius": "radius"}
    plain = {"start": "start", "swing_deg": "swing", "period": "period"}
    found |= {logs[k]: math.log(v) for k, v in emission.items() if k in logs}
    found |= {plain[k]: float(v) for k, v in emission.items() if k in plain}
    if "size" in shape:  # nozzles lie across their jets
        found["width"] = math.log(float(shape["size"][0]))
    if "center" in shape:
        found["x"], found["y"] = (float(v) for v in shape["center"])
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
    return {"center": [v["x"], v["y"]], "width": width, "emission": emission}


def _finished(kind: str, numbers: Mapping[str, float], error: float) -> Nozzle:
    found = _nozzle(kind, numbers)
    shape = {
        "type": "box",
        "center": found["center"],
        "angle_deg": math.remainder(math.degrees(numbers["heading"]) - 90.0, 360.0),
        "size": [found["width"], DEPTH],
    }
    return Nozzle(shape, found["emission"], error)
