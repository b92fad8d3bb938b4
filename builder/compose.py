"""Parents: scenes composed of objects of two seeds, in a new layout."""

import copy

import numpy as np

from mpmworlds.builder.attempt import Data
from mpmworlds.builder.modify import scale_shape
from mpmworlds.builder.perturb import rounded
from mpmworlds.sim.palette import PALETTE, hue_difference, saturation

MOST_TAKEN = 2  # objects taken from the second seed
HUE_STEP = 30.0  # least hue difference of a new object's colour [deg]
MOVING_PARTS = ("initial_state", "kinematics", "emission")
VECTORS = ("velocity", "amplitude")  # their x changes sign in a mirror
TURNS = (  # and so do these
    *("angle_deg", "angular_velocity", "amplitude_deg"),
    *("surface_speed", "swing_deg"),
)
VIVID = [color for color in PALETTE.values() if saturation(color) > 0.5]


def compose(rng: np.random.Generator, scene: Data, *, other: Data) -> Data:
    """Put objects of another scene into a scene, in place; returns the record.

    The scene is mirrored or not. One or two objects are taken, scaled, placed anew and
    given a colour that the scene does not have.
    """
    mirrored = bool(rng.integers(2))
    if mirrored:
        mirror(scene)
    count = int(rng.integers(1, min(MOST_TAKEN, len(other["objects"])) + 1))
    chosen = sorted(rng.permutation(len(other["objects"]))[:count].tolist())
    for i in chosen:
        thing = copy.deepcopy(other["objects"][i])
        scale_shape(thing["shape"], rounded(rng.uniform(0.6, 1.0), 2))
        thing["shape"]["center"] = [rounded(x) for x in rng.uniform(0.08, 0.92, 2)]
        thing["visualization"] = {"color": _free_color(rng, scene)}
        scene["objects"].append(thing)
    taken = [other["objects"][i]["name"] for i in chosen]
    for i, thing in enumerate(scene["objects"]):
        thing["name"] = f"object_{i}"
    scene["simulation"]["seed"] = int(rng.integers(2**31))
    return {"operator": "compose", "mirrored": mirrored, "taken": taken}


def mirror(scene: Data) -> None:
    """Exchange left and right, in place."""
    gravity = scene["environment"]["gravity"]
    gravity[0] = 0.0 - gravity[0]
    for thing in scene["objects"]:
        shape = thing["shape"]
        shape["center"][0] = rounded(1.0 - shape["center"][0])
        for vertex in shape.get("vertices", []):
            vertex[0] = 0.0 - vertex[0]
        for part in (shape, *(thing.get(name, {}) for name in MOVING_PARTS)):
            for key in TURNS:
                if key in part:
                    part[key] = 0.0 - part[key]
            for key in VECTORS:
                if key in part:
                    part[key][0] = 0.0 - part[key][0]
        if shape["type"] == "fan_blades":  # its first blade points to the other side
            shape["angle_deg"] = (shape["angle_deg"] + 360.0) % 360.0 - 180.0


def _free_color(rng: np.random.Generator, scene: Data) -> str:
    """A vivid palette colour whose hue no coloured object of the scene is near.

    Where a scene has no room for another hue it is any vivid one, and no valid draw.
    """
    used = [o["visualization"]["color"] for o in scene["objects"]]
    hued = [color for color in used if saturation(color) > 0.2]
    free = [
        color
        for color in VIVID
        if all(hue_difference(color, other) > HUE_STEP for other in hued)
    ]
    return str(rng.choice(free or VIVID))
