"""What no prefix shows: a table of the train split, and what it says of a scene.

`counting` makes it. Whatever else search takes for granted is of train rows, too.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final

import numpy as np
import yaml

from mpmworlds.baselines.search.outlines import Outline

Data = dict[str, Any]

PLACE: Final = "mpmworlds.baselines.search"
TABLE: Final = "prior.yaml"
KIND: Final = ":"  # between the name of a class and the number of a kind of it
QUARTILES: Final = (0.25, 0.5, 0.75)
TENTHS: Final = tuple(k / 10 for k in range(11))
LATEST: Final = 0.05  # time after the prefix when what goes on in it stops at least [s]
FRICTIONLESS: Final = ("sticky",)  # laws to which friction is nothing


def motion_of(collider: Mapping[str, Any]) -> str:
    """How a collider in plain data moves; `still` if it does not."""
    return str(collider.get("kinematics", {}).get("type", "still"))


@dataclass(frozen=True)
class Prior:
    """Shares and middles of the train split."""

    samples: int
    """Number of scenes counted."""
    simulation: Data
    """What most scenes have: cells, particles a cell, thickness of walls."""
    frame_time: float
    """Simulated seconds in a second of video."""
    materials: Mapping[str, Data]
    """Class -> share among bodies and emitters, and median of each number."""
    same_material: float
    """Share of scenes of one material, among those with several things of matter."""
    gravities: Sequence[Data]
    """Gravities that many scenes share, with their shares."""
    walls: Sequence[Data]
    """Contact law of walls, share, and frictions that many scenes share, if it has
    any: they come from few scenes, so that most have one of a handful."""
    contact: Data
    """Contact of most colliders."""
    contacts: Mapping[str, Mapping[str, Data]]
    """Type of a shape -> motion, or `still` -> contact that most such colliders have.
    """
    belts: Mapping[str, float]
    """Type of a shape -> share of belts among colliders of it that stay where they are.
    """
    belt_speed: float
    """Median speed of the surface of belts [m/s]; 0 if there are none."""
    ways: Sequence[Data]
    """Ways of translating colliders [m], `TENTHS` of them, by the least speed of those
    counted [m/s], the slowest first: what is slow does not get far."""
    emission_stops: Mapping[str, Sequence[float]]
    """Kind of nozzle -> quartiles of the time when such emitters stop [s]."""
    outlines: Sequence[Outline]
    """Those that most polygons have, see `usual_outlines`."""
    still: float
    """Part of its area that changes from frame to frame at the end of the prefix, below
    which a thing has settled; `python -m benchmarks.search settled` fits it."""

    def typical(self, material: str) -> Data:
        """Plain data of a typical material of a class, or of a kind of it.

        See `kinds`.
        """
        name, _, kind = material.partition(KIND)
        known = self.materials[name]
        numbers: Data = known["kinds"][int(kind)] if kind else known["numbers"]
        return {"constitutive_model": name} | numbers

    def contact_of(self, thing: Mapping[str, Any]) -> Data:
        """Contact that most colliders of a shape and motion have."""
        known = self.contacts.get(thing["shape"]["type"], {})
        return dict(self.contact) | known.get(motion_of(thing), {})

    def usual_friction(self, walls: Mapping[str, Any]) -> float:
        """Friction nearest to one that walls of a law have in train; itself if none."""
        friction: float = walls["friction"]
        alike = [w["frictions"] for w in self.walls if w["contact"] == walls["contact"]]
        usual = alike[0] if alike else ()
        return min(usual, key=lambda one: abs(one - friction), default=friction)

    def belt_share(self, thing: Mapping[str, Any]) -> float:
        """Share of belts among still colliders of the shape of one."""
        return self.belts.get(thing["shape"]["type"], 0.0)

    def way(self, speed: float, gone: float, part: float) -> float:
        """How far a translation leads [m] that has led so far already.

        Parameters
        ----------
        speed
            Of the collider [m/s].
        gone
            Way that is seen [m].
        part
            Quantile, among those of about this speed that lead farther.
        """
        tenths = [g["way"] for g in self.ways if g["speed"] <= speed]
        level = float(np.interp(gone, tenths[-1], TENTHS))
        level += part * (1.0 - level)
        return max(gone, float(np.interp(level, TENTHS, tenths[-1])))

    def stop(self, motion: Mapping[str, Any], end: float, part: float) -> float:
        """When a translation in plain data stops that goes on at the end of a prefix.

        Parameters
        ----------
        motion
            ``velocity``, and ``start`` if it is not 0.
        end
            Time at the end of the prefix [s].
        part
            Quantile, see `way`.
        """
        speed = max(math.hypot(*motion["velocity"]), 1e-3)
        start = float(motion.get("start", 0.0))
        way = self.way(speed, (end - start) * speed, part)
        return max(start + way / speed, end + LATEST)

    def common(self, count: int) -> list[str]:
        """Classes that most matter is of, the commonest first."""
        names = sorted(self.materials, key=lambda n: (-self.materials[n]["share"], n))
        return names[:count]

    def kinds(self, material: str) -> list[str]:
        """Names of the kinds of a class that are far from the typical one."""
        return [
            f"{material}{KIND}{k}"
            for k in range(len(self.materials[material]["kinds"]))
        ]


@cache
def prior() -> Prior:
    """The recorded table."""
    text = files(PLACE).joinpath(TABLE).read_text("utf-8")
    return Prior(**yaml.safe_load(text))
