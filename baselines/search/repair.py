"""A scene as it was found, made one that can be linked and run.

Fits are a pixel off here and there: a body overlaps what it lies on, a shape reaches
into a wall, a jet is denser than its material.
"""

import copy
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from mpmworlds.baselines.filling import scene_of
from mpmworlds.baselines.protocol import SceneText
from mpmworlds.sim.scene.checks import COLLIDERS, check_scene
from mpmworlds.sim.scene.objects import SHAPES
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import with_fewest_steps

Data = dict[str, Any]

TRIES: Final = 60  # small changes of one scene, and as many larger ones
INWARD: Final = 0.002  # a step away from a wall, at least [m]
FAR_IN: Final = 0.25  # part of the way out of a wall that is one step
NEAR: Final = 0.06  # a wall is, at most [m]
BACK: Final = 0.001  # a step of a nozzle away from what it points at [m]
NARROWER: Final = 0.95  # of the width of a nozzle
FLATTER: Final = 0.93  # of the depth of a nozzle, which does nothing
FLATTEST: Final = 0.012  # [m]
LENGTHS: Final = (
    *("radius", "size", "semi_axes", "corner_radius", "length", "thickness"),
    *("blade_length", "vertices"),
)


def unchecked(data: Data) -> Scene:
    """A scene whose fields are valid, with as few steps as are stable.

    Raises
    ------
    ValueError
        If a field is not valid.
    """
    try:
        scene = Scene.model_validate(data | {"objects": tuple(data["objects"])})
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ValueError(f"{place}: {first['msg']}") from None
    return with_fewest_steps(scene)


def repaired(data: Data) -> Data:
    """A valid scene near to one that is not quite, in plain data.

    Raises
    ------
    ValueError
        If it takes more than small changes.
    """
    data = copy.deepcopy(data)
    for mends in (*[_MENDS] * TRIES, *[_HARDER] * TRIES):
        broken = _broken(data)
        if not broken:
            return data
        for number, rule in broken:
            mend = mends.get(rule)
            if mend is None:
                raise ValueError(f"objects[{number}] breaks the rule of {rule}")
            mend(data["objects"][number])
    raise ValueError(f"objects still break rules: {_broken(data)}")


def written(data: Data) -> str:
    """The scene file of plain data, repaired if need be.

    Raises
    ------
    ValueError
        If it takes more than small changes.
    """
    found = scene_of(repaired(data))
    if not isinstance(found, SceneText):
        raise ValueError(found.reason)
    return found.text


def _broken(data: Data) -> list[tuple[int, str]]:
    """Objects and the rules that they break; of two that overlap the softer one."""
    scene = unchecked(data)
    found = []
    for number, thing in enumerate(scene.objects):
        rules = {rule for rule, _ in check_scene(scene, number)}
        if thing.object_type in COLLIDERS:
            rules -= {"overlap", "tearing"}
        found += [(number, rule) for rule in sorted(rules) if rule != "stability"]
    return found


def scaled(shape: Data, factor: float) -> None:
    """Make a shape larger or smaller about its center."""
    for key in LENGTHS:
        if key in shape:
            shape[key] = (np.array(shape[key]) * factor).tolist()


def _inward(thing: Data) -> None:
    """Away from the walls, or less far on its way."""
    motion = thing.get("kinematics")
    if motion and motion["type"] in ("translate", "oscillate"):
        _less(motion)
        return
    shape = thing["shape"]
    outline = np.concatenate(SHAPES[shape["type"]].model_validate(shape).outline())
    low, high = outline.min(axis=0), outline.max(axis=0)
    room = np.minimum(low, 1.0 - high)
    step = np.where(room > NEAR, 0.0, np.maximum(INWARD, -FAR_IN * room))
    push = np.where(low < 1.0 - high, step, -step)
    shape["center"] = (np.array(shape["center"]) + push).tolist()
    scaled(shape, 0.995)
    if "emission" in thing:
        _thin(thing)


def _less(motion: Mapping[str, Any]) -> None:
    """A motion that leads less far."""
    if not isinstance(motion, dict):
        return
    if motion["type"] == "translate":
        start = motion.get("start", 0.0)
        motion["stop"] = start + 0.96 * (motion["stop"] - start)
    for key in ("amplitude", "amplitude_deg"):
        if key in motion:
            motion[key] = (0.97 * np.array(motion[key])).tolist()


def _shrink(thing: Data) -> None:
    if "emission" in thing:
        _back(thing)
    else:
        scaled(thing["shape"], 0.992)


def _back(thing: Data) -> None:
    """A nozzle that is flatter, a little farther behind what comes out of it.

    What it lies on is mostly in front of it: jets start where they are seen first.
    """
    shape = thing["shape"]
    width, depth = shape["size"]
    shape["size"] = [0.997 * width, max(FLATTER * depth, min(depth, FLATTEST))]
    velocity = np.array(thing["emission"]["velocity"])
    speed = max(float(np.hypot(*velocity)), 1e-6)
    shape["center"] = (np.array(shape["center"]) - BACK * velocity / speed).tolist()


def _narrow(thing: Data) -> None:
    """A nozzle that is narrower: what it lies on is on all sides of it."""
    if "emission" in thing:
        width, depth = thing["shape"]["size"]
        thing["shape"]["size"] = [NARROWER * width, depth]
        _thin(thing)
    else:
        _shrink(thing)


def _thin(thing: Data) -> None:
    """A jet of fewer particles."""
    emission = thing["emission"]
    emission["rate"] *= 0.97
    size = thing["shape"]["size"]
    if emission["type"] == "rain" and 2 * emission["drop_radius"] > 0.97 * size[0]:
        emission["drop_radius"] = 0.48 * size[0]


def _pass_by(thing: Data) -> None:
    motion = thing.get("kinematics")
    if motion and motion["type"] in ("translate", "oscillate"):
        _less(motion)
    else:
        scaled(thing["shape"], 0.99)


def _grow(thing: Data) -> None:
    if "emission" in thing:
        thing["emission"]["rate"] *= 0.9
    else:
        scaled(thing["shape"], 1.05)


def _slow(thing: Data) -> None:
    motion = thing.get("kinematics") or thing.get("initial_state") or {}
    for key in ("angular_velocity", "velocity", "frequency"):
        if key in motion:
            motion[key] = (0.9 * np.array(motion[key])).tolist()


def _rub(thing: Data) -> None:
    thing["contact"]["friction"] = 0.5


_MENDS: Final[dict[str, Callable[[Data], None]]] = {
    "domain": _inward,
    "overlap": _shrink,
    "jets": _thin,
    "sweeps": _pass_by,
    "particles": _grow,
    "speeds": _slow,
    "tearing": _slow,
    "belts": _rub,
}
_HARDER: Final = _MENDS | {"overlap": _narrow}
