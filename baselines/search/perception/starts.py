"""Where fits of nozzles start: growth, drops, and what is told."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.perception.drops import Drops
from mpmworlds.baselines.search.perception.flow import SPACING
from mpmworlds.baselines.search.perception.order import numbered, spread
from mpmworlds.baselines.search.perception.pixels import Pixels
from mpmworlds.baselines.search.perception.tracks import Track
from mpmworlds.baselines.search.perception.usual_nozzles import DENSE, WIDE

NARROW: Final = 0.02  # between the outermost drops of a nozzle, at least [m]
# Start of rain [s] before which most is meant to start with the scene, hardly any not.
AT_ONCE: Final = 0.12


class Starts:
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
        radius = math.exp(self._told.get("radius", math.log(max(drops.radius, 0.004))))
        count = max(round(math.pi * (radius / SPACING) ** 2), 1)
        if {"rate", "start"} <= self._told.keys():
            gap = count / math.exp(self._told["rate"])
            numbers = np.maximum(np.rint((born - self._told["start"]) / gap - 0.5), 0.0)
        else:
            numbers, gap = numbered(born, side, len(self._masks) * self._frame)
        start = float(np.mean(born - gap * (numbers + 0.5)))
        if "start" in self._told or start < AT_ONCE:
            level -= speed * (self._told.get("start", 0.0) - start)
            start = self._told.get("start", 0.0)
        middle, width = spread(side, numbers, max(usual - 2 * drops.radius, NARROW))
        center = level * ahead + middle * across
        return {
            "x": float(center[0]),
            "y": float(center[1]),
            "speed": speed,
            "heading": math.atan2(velocity[1], velocity[0]),
            "rate": math.log(count / gap),
            "width": math.log(width + 2 * drops.radius),
            "start": start,
            "radius": math.log(radius),
        } | self._told


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
