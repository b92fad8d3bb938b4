"""A thing made of another class, which is drawn larger or less than of the last one."""

import copy
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.perception.edges import Edge
from mpmworlds.baselines.search.perception.pixels import GROWN
from mpmworlds.baselines.search.repair import scaled
from mpmworlds.sim.scene.fields import polygon_area
from mpmworlds.sim.scene.objects import SHAPES

Data = dict[str, Any]

# By how much bodies are drawn larger than they are, all around [m]: measured on a box
# of each class. Those of a mesh have particles on their outline, which is splatted;
# those that are rigid are drawn as they are.
DRAWN: Final[Mapping[str, float]] = {"elastic_fem": 0.67 / 256, "rigid": 0.0}


def looks_like(name: str, edge: Edge) -> bool:
    """Whether the edge of a body may be that of a class: others are particles."""
    return edge is Edge.UNCLEAR or (name in DRAWN) == (edge is Edge.SHARP)


def of_matter(
    thing: Mapping[str, Any], properties: Mapping[str, Any], known: Mapping[str, Any]
) -> Data:
    """A thing of a scene, made of something else.

    Parameters
    ----------
    thing
        Plain data of a body or an emitter.
    properties
        Plain data of its new material.
    known
        What is told of the thing; a shape that is told stays as it is.

    Returns
    -------
    dict
        The thing. A body whose shape was fitted to what is drawn is as much smaller as
        its class is drawn larger.
    """
    changed = copy.deepcopy(dict(thing))
    before = changed.get("physics_properties", {}).get("constitutive_model", "")
    changed["physics_properties"] = dict(properties)
    told = set(known.get("shape") or {}) - {"type", "center", "angle_deg"}
    if changed["object_type"] == "dynamic_body" and not told:
        after = str(properties["constitutive_model"])
        more = DRAWN.get(before, GROWN) - DRAWN.get(after, GROWN)
        if more:
            _grow(changed["shape"], more)
    return changed


def _grow(shape: Data, distance: float) -> None:
    """Scale a shape by as much area as a rim of a width has [m]."""
    outline = SHAPES[shape["type"]].model_validate(shape).local_outline()
    area = sum(map(polygon_area, outline))
    rim = sum(
        float(np.hypot(*(np.roll(p, -1, axis=0) - p).T).sum())
        for p in map(np.array, outline)
    )
    scaled(shape, max(1.0 + 0.5 * distance * rim / area, 0.5))
