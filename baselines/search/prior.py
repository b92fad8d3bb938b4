"""What no prefix shows: a table of the train split, and the command that makes it.

``python -m mpmworlds.baselines.search.prior --release DIR`` writes ``prior.yaml``
beside this module. Whatever else search takes for granted is of train rows, too.
"""

import argparse
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from mpmworlds.baselines.search.outlines import Outline, usual_outlines
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.machine_yaml import read_machine_yaml
from mpmworlds.loaders.load import load
from mpmworlds.sim.scene.objects import MATERIALS

Data = dict[str, Any]

PLACE: Final = "mpmworlds.baselines.search"
TABLE: Final = "prior.yaml"
COMMON: Final = 0.02  # share of a gravity, or of a friction, that is tried
DIGITS: Final = 4
KIND: Final = ":"  # between the name of a class and the number of a kind of it
FAR: Final = 1.8  # ratio of a number to the typical one of another kind
MANY: Final = 0.012  # share of a class that is a kind of its own
QUARTILES: Final = (0.25, 0.5, 0.75)
TENTHS: Final = tuple(k / 10 for k in range(11))
LATEST: Final = 0.05  # time after the prefix when what goes on in it stops at least [s]
SPEEDS: Final = 20  # groups of translating colliders, of equal size, by speed
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


def counted(scenes: Iterable[Mapping[str, Any]]) -> Prior:
    """The table of scenes in plain data."""
    all_ = list(scenes)
    things = [thing for scene in all_ for thing in scene["objects"]]
    matter = [t["physics_properties"] for t in things if "physics_properties" in t]
    contacts = Counter(
        (t["contact"]["type"], t["contact"]["friction"], t["contact"]["skin_cells"])
        for t in things
        if "contact" in t
    )
    law, friction, skin = contacts.most_common(1)[0][0]
    several = [
        {t["physics_properties"]["constitutive_model"] for t in found}
        for found in (_matter(scene) for scene in all_)
        if len(found) > 1
    ]
    return Prior(
        samples=len(all_),
        simulation={
            name: Counter(s["simulation"][name] for s in all_).most_common(1)[0][0]
            for name in ("grid_resolution", "particles_per_cell")
        }
        | {
            "thickness_cells": Counter(
                s["environment"]["walls"]["thickness_cells"] for s in all_
            ).most_common(1)[0][0]
        },
        frame_time=_round(np.median([_pace(s) for s in all_])),
        materials=_materials(matter),
        same_material=_round(np.mean([len(names) == 1 for names in several])),
        gravities=[
            {"value": list(value), "share": _round(count / len(all_))}
            for value, count in Counter(
                tuple(s["environment"]["gravity"]) for s in all_
            ).most_common()
            if count > COMMON * len(all_)
        ],
        walls=_walls(all_),
        contact={"type": law, "friction": friction, "skin_cells": skin},
        **_of_colliders(things),
        ways=_ways(things),
        emission_stops=_stops(things),
        outlines=usual_outlines(
            t["shape"]["vertices"] for t in things if t["shape"]["type"] == "polygon"
        ),
        still=prior().still,
    )


def _matter(scene: Mapping[str, Any]) -> list[Data]:
    return [t for t in scene["objects"] if "physics_properties" in t]


def _of_colliders(things: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Contacts and belts, by the types of shapes and how colliders move."""
    known: dict[str, dict[str, list[Mapping[str, Any]]]] = {}
    for thing in things:
        if "contact" in thing:
            of_shape = known.setdefault(thing["shape"]["type"], defaultdict(list))
            of_shape[motion_of(thing)].append(thing)
    contacts, belts, speeds = {}, {}, []
    for shape, found in sorted(known.items()):
        contacts[shape] = {m: _contact(some) for m, some in sorted(found.items())}
        moving, still = found["conveyor"], found["still"]
        if moving or still:
            belts[shape] = _round(len(moving) / (len(moving) + len(still)))
        speeds += [abs(thing["kinematics"]["surface_speed"]) for thing in moving]
    speed = _round(np.median(speeds)) if speeds else 0.0
    return {"contacts": contacts, "belts": belts, "belt_speed": speed}


def _contact(colliders: Sequence[Mapping[str, Any]]) -> Data:
    """Law that most of them have, and their median friction."""
    laws = Counter(thing["contact"]["type"] for thing in colliders)
    friction = np.median([thing["contact"]["friction"] for thing in colliders])
    return {"type": laws.most_common(1)[0][0], "friction": _round(friction)}


def _ways(things: Iterable[Mapping[str, Any]]) -> list[Data]:
    """Ways of translations, by groups of about the same speed."""
    pairs = [
        (speed, speed * (motion["stop"] - motion["start"]))
        for motion in (t.get("kinematics", {}) for t in things)
        if motion.get("type") == "translate"
        for speed in [float(np.hypot(*motion["velocity"]))]
    ]
    groups = np.array_split(np.array(sorted(pairs)), min(SPEEDS, len(pairs)))
    return [
        {
            "speed": _round(group[0, 0]) if number else 0.0,
            "way": [_round(v) for v in np.quantile(group[:, 1], TENTHS)],
        }
        for number, group in enumerate(groups)
    ]


def _stops(things: Iterable[Mapping[str, Any]]) -> dict[str, list[float]]:
    """Times when emitters stop, by kinds of nozzles."""
    stops = defaultdict(list)
    for emission in (t["emission"] for t in things if "emission" in t):
        stops[emission["type"]].append(emission["stop"])
    return {
        kind: [_round(v) for v in np.quantile(found, QUARTILES)]
        for kind, found in sorted(stops.items())
    }


def _pace(scene: Mapping[str, Any]) -> float:
    simulation = scene["simulation"]
    frame = simulation["time_step_dt"] * simulation["substeps_per_frame"]
    return float(frame * scene["output"]["framerate"])


def _materials(matter: Sequence[Data]) -> dict[str, Data]:
    by_name: dict[str, list[Data]] = defaultdict(list)
    for properties in matter:
        by_name[properties["constitutive_model"]].append(properties)
    found = {}
    for name in sorted(MATERIALS):
        numbers = {
            key: _round(np.median([p[key] for p in by_name[name] if key in p]))
            for key in by_name[name][0]
            if key != "constitutive_model"
        }
        share = _round(len(by_name[name]) / len(matter))
        kinds = _kinds(by_name[name], numbers)
        found[name] = {"share": share, "numbers": numbers, "kinds": kinds}
    return found


def _kinds(matter: Sequence[Data], numbers: Data) -> list[Data]:
    """Medians of those that have a number far from the typical one, if not too few."""
    found: list[Data] = []
    for key, typical in numbers.items():
        known = [p for p in matter if p.get(key, 0.0) > 0.0 and typical > 0.0]
        for some in (
            [p for p in known if p[key] > FAR * typical],
            [p for p in known if p[key] < typical / FAR],
        ):
            if len(some) > MANY * len(matter):
                medians = {
                    name: _round(np.median([p[name] for p in some if name in p]))
                    for name in numbers
                }
                if all(_apart(medians, other) for other in found):
                    found.append(medians)
    return found


def _apart(one: Data, other: Data) -> bool:
    """Whether two kinds differ in a number by much."""
    return any(
        max(one[key], other[key]) > FAR * max(min(one[key], other[key]), 1e-9)
        for key in one
    )


def _walls(scenes: Sequence[Mapping[str, Any]]) -> list[Data]:
    """For each law, its share and usual frictions, the lowest first."""
    frictions: dict[str, list[float]] = defaultdict(list)
    for scene in scenes:
        walls = scene["environment"]["walls"]
        frictions[walls["contact"]].append(walls["friction"])
    return [
        {
            "contact": law,
            "frictions": _frictions(law, values),
            "share": _round(len(values) / len(scenes)),
        }
        for law, values in sorted(frictions.items(), key=lambda p: (-len(p[1]), p[0]))
    ]


def _frictions(law: str, values: Sequence[float]) -> list[float]:
    if law in FRICTIONLESS:
        return [_round(np.median(values))]
    counts = Counter(map(_round, values))
    return sorted(v for v, count in counts.items() if count > COMMON * len(values))


def _round(value: Any) -> float:
    return float(f"{float(value):.{DIGITS}g}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Count the train split of a release and write the table."""
    parser = argparse.ArgumentParser(description="Count what search takes for usual.")
    parser.add_argument("--release", type=Path, required=True)
    parser.add_argument("--config", default="recipes")
    options = parser.parse_args(arguments)
    rows = load(options.release, "train", options.config).table
    table = counted(map(read_machine_yaml, rows["scene"]))
    write_prior(vars(table))


def write_prior(table: Mapping[str, Any]) -> None:
    """Record a table beside this module."""
    text = yaml.safe_dump(dict(table), sort_keys=False, default_flow_style=None)
    write_atomically(Path(__file__).with_name(TABLE), text.encode())


if __name__ == "__main__":
    main()
