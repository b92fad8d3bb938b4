"""What a scene must save of its loss to be believed, for being unusual."""

import math
from collections.abc import Sequence
from typing import Any, Final

from mpmworlds.baselines.search.perception.nozzles import crowding
from mpmworlds.baselines.search.prior import Prior
from mpmworlds.baselines.search.trials.readings import classes_of

Data = dict[str, Any]

SURPRISE: Final = 0.002  # loss that a class is worth for each e-fold of rarity
SECOND_CLASS: Final = 0.006  # loss that a second class in a scene is worth
THIN: Final = 0.001  # loss that one is worth which is a deviation denser, or less
UNSURE: Final = 0.15  # difference from a gravity that was measured [m/s^2]
ASTRAY: Final = 0.004  # loss that so large a one is worth
RARE: Final = 0.01  # loss that a gravity is worth which is neither usual nor seen


def unusual(data: Data, prior: Prior, gravity: Sequence[float] | None) -> float:
    """Loss of the prefix that makes up for how unusual a scene is.

    Parameters
    ----------
    data
        Plain data of the scene.
    prior
        What is usual.
    gravity
        As flights tell it, if they do [m/s^2].
    """
    names = classes_of(data)
    extra = SECOND_CLASS * max(len(set(names)) - 1, 0)
    law = data["environment"]["walls"]["contact"]
    shares = [w["share"] for w in prior.walls if w["contact"] == law]
    walls = rarity(shares[0]) if shares else 0.0
    matter = sum(rare(name, prior) for name in names) / max(len(names), 1)
    jets = sum(map(_crowded, data["objects"]))
    pull = RARE * (gravity is None and not customary(data, prior))
    laws = sum(map(_other_law, data["objects"]))
    return matter + extra + walls + jets + pull + laws + _astray(data, gravity)


def customary(data: Data, prior: Prior) -> bool:
    """Whether the gravity of a scene is one that many scenes share.

    Three of four have that of the earth exactly, and hardly one what is near to it.
    """
    gravity = list(data["environment"]["gravity"])
    return any(list(usual["value"]) == gravity for usual in prior.gravities)


def _other_law(thing: Data) -> float:
    """Nine of ten colliders have one law of contact, the others either of two."""
    separate = thing.get("contact", {}).get("type", "separate") == "separate"
    return 0.0 if separate else rarity(0.05)


def _crowded(thing: Data) -> float:
    """What is poured is about as dense as most: rate and width trade for each other."""
    emission = thing.get("emission")
    if emission is None:
        return 0.0
    width, speed = thing["shape"]["size"][0], math.hypot(*emission["velocity"])
    return (
        THIN
        * crowding(emission["type"], emission["rate"], width, max(speed, 0.01)) ** 2
    )


def rare(name: str, prior: Prior) -> float:
    """Loss that makes up for the rarity of a class."""
    return rarity(prior.materials[name]["share"])


def rarity(share: float) -> float:
    """Loss that makes up for how few have something, of all."""
    return -SURPRISE * math.log(share)


def _astray(data: Data, gravity: Sequence[float] | None) -> float:
    """Walls without friction look like a pull aside: gravity that is seen is kept."""
    if gravity is None:
        return 0.0
    off = math.dist(data["environment"]["gravity"], gravity)
    return ASTRAY * (off / UNSURE) ** 2
