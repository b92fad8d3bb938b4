"""Parents: scenes composed of objects of two seeds, in a new layout."""

import numpy as np

from mpmworlds.builder.attempt import Data
from mpmworlds.builder.modify import scale_shape
from mpmworlds.builder.perturb import perturb, rounded
from mpmworlds.sim.palette import PALETTE, hue_deg, saturation

MOST_TAKEN = 2  # objects taken from the second seed
HUE_STEP = 30.0  # least hue difference of a new object's colour [deg]
VIVID = [color for color in PALETTE.values() if saturation(color) > 0.5]


def compose(rng: np.random.Generator, scene: Data, *, other: Data) -> Data:
    """Put objects of another scene into a scene, in place; returns the record.

    One or two objects are taken, scaled, placed anew and given a colour that the scene
    does not have; the objects that were there are jittered.
    """
    perturb(rng, scene)
    count = int(rng.integers(1, min(MOST_TAKEN, len(other["objects"])) + 1))
    chosen = sorted(rng.permutation(len(other["objects"]))[:count].tolist())
    for i in chosen:
        thing = other["objects"][i]
        thing = {**thing, "shape": dict(thing["shape"])}
        scale_shape(thing["shape"], rounded(rng.uniform(0.6, 1.0), 2))
        thing["shape"]["center"] = [rounded(x) for x in rng.uniform(0.08, 0.92, 2)]
        thing["visualization"] = {"color": _free_color(rng, scene)}
        scene["objects"].append(thing)
    taken = [other["objects"][i]["name"] for i in chosen]
    for i, thing in enumerate(scene["objects"]):
        thing["name"] = f"object_{i}"
    return {"operator": "compose", "taken": taken}


def _free_color(rng: np.random.Generator, scene: Data) -> str:
    """A vivid palette colour whose hue no coloured object of the scene is near."""
    used = [o["visualization"]["color"] for o in scene["objects"]]
    hues = [hue_deg(color) for color in used if saturation(color) > 0.2]
    free = [
        color
        for color in VIVID
        if all(
            abs((hue_deg(color) - h + 180.0) % 360.0 - 180.0) > HUE_STEP for h in hues
        )
    ]
    return str(rng.choice(free))
