"""Scenes that are told in part, and completed."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import yaml

from mpmworlds.baselines.protocol import Failure, SceneText
from mpmworlds.sim.scene.fields import TOLD_APART_BY
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import with_fewest_steps

FINER: Final = 8  # times as many steps, until it is known how many are needed
MIDDLE: Final = {"shape": {"center": [0.5, 0.5]}}
LENT: Final = ("physics_properties", "initial_state", "contact")  # by other types

Data = dict[str, Any]


def scene_of(data: Data) -> SceneText | Failure:
    """A scene with the steps that it needs, or what is wrong with it."""
    simulation = data["simulation"]
    fine = {
        "time_step_dt": float(f"{simulation['time_step_dt'] / FINER:.9g}"),
        "substeps_per_frame": simulation["substeps_per_frame"] * FINER,
    }
    try:
        scene = Scene.from_data(data | {"simulation": simulation | fine})
    except ValueError as error:
        return Failure("invalid_scene", str(error))
    return SceneText(with_fewest_steps(scene).to_yaml())


def told_scene(side_info: str) -> Data | None:
    """The scene with gaps that a regime tells, if it tells one."""
    try:
        data = yaml.safe_load(side_info)
    except yaml.YAMLError:
        return None
    there = isinstance(data, dict) and isinstance(data.get("objects"), list)
    return data if there else None


def filled(told: Data, base: Data) -> Data:
    """A scene with gaps, filled from another scene.

    Parameters
    ----------
    told, base
        Plain data of both. Each object of the first gets what it lacks from the first
        one of its type of the other that has not been used, else from any of its type.

    Returns
    -------
    dict
        Plain data; perhaps of no valid scene.
    """
    scene = {key: _over(told.get(key), base[key]) for key in base if key != "objects"}
    left = list(base["objects"])
    things = []
    for thing in told["objects"]:
        alike = [other for other in left if _alike(thing, other)]
        things.append(_over(thing, alike[0] if alike else _donor(thing, base)))
        left = [other for other in left if other is not (alike or [None])[0]]
    return scene | {"objects": things}


def _alike(one: Data, other: Data) -> bool:
    return bool(one["object_type"] == other["object_type"])


def _donor(thing: Data, base: Data) -> Data:
    """An object of the type, else parts of objects of other types."""
    others: Sequence[Data] = base["objects"]
    for other in others:
        if _alike(thing, other):
            return other
    parts: Data = dict(MIDDLE)
    for other in others:
        parts = {key: other[key] for key in LENT if key in other} | parts
    return parts


def _over(told: Any, base: Any) -> Any:
    """What is told, with its gaps filled where both are of one kind."""
    if told is None:
        return base
    if not isinstance(told, dict) or not isinstance(base, Mapping):
        return told
    if any(told.get(key, base.get(key)) != base.get(key) for key in TOLD_APART_BY):
        return {key: base[key] for key in ("center",) if key in base} | told
    return {key: _over(told.get(key), base.get(key)) for key in {**base, **told}}
