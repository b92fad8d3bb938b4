"""The table of the train split is counted from its scenes, and recorded.

``python -m mpmworlds.baselines.search.counting --release DIR`` writes ``prior.yaml``
beside this module.
"""

import argparse
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from mpmworlds.baselines.search.outlines import usual_outlines
from mpmworlds.baselines.search.prior import (
    FRICTIONLESS,
    QUARTILES,
    TABLE,
    TENTHS,
    Data,
    Prior,
    motion_of,
    prior,
)
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.machine_yaml import read_machine_yaml
from mpmworlds.loaders.load import load
from mpmworlds.sim.scene.objects import MATERIALS

COMMON: Final = 0.02  # share of a gravity, or of a friction, that is tried
DIGITS: Final = 4
FAR: Final = 1.8  # ratio of a number to the typical one of another kind
MANY: Final = 0.012  # share of a class that is a kind of its own
SPEEDS: Final = 20  # groups of translating colliders, of equal size, by speed


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
