"""What a scene must save of its loss to be believed, for being unusual."""

import math
from collections.abc import Sequence
from typing import Any, Final

from mpmworlds.baselines.search.perception.usual_nozzles import crowding
from mpmworlds.baselines.search.prior import Prior
from mpmworlds.baselines.search.trials.readings import classes_of

Data = dict[str, Any]

SURPRISE: Final = 0.002  # loss that a class is worth for each e-fold of rarity
SECOND_CLASS: Final = 0.006  # loss that a second class in a scene is worth
SPREAD: Final = 0.3  # of the logarithms of numbers of a material, about, in train
SPREADS: Final = {"density": 0.2, "poissons_ratio": 0.12}
ODD: Final = 0.0006  # loss that a number is worth which is so far from the usual one
ODDEST: Final = 25.0  # square of what counts at most: a few scenes have quite others
UNCOMMON: Final = 8.0  # the same for a kind that few are of
USUAL_LAW: Final = "separate"  # of colliders
ALL_ALIKE: Final = 0.2  # share of scenes whose colliders are of another law, the walls'
MIXED: Final = 0.05  # share of those of other laws
SPINNING: Final = 0.36  # share of bodies that spin at first, of those that move then
LEAST_SPIN: Final = 0.83  # of those [rad/s]
LEAST_SPEED: Final = 0.08  # of bodies that move at first [m/s]
NONE: Final = 0.003  # share of scenes that have what none of train has, at most
THIN: Final = 0.001  # loss that one is worth which is a deviation denser, or less
UNSURE: Final = 0.15  # difference from a gravity that was measured [m/s^2]
ASTRAY: Final = 0.004  # loss that so large a one is worth
UNEVEN: Final = 0.06  # loss that walls are worth whose friction is 1 off usual ones
ODD_WALLS: Final = 0.01  # and what such a scene is worth in the end, more than that
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
    walls += _uneven(data["environment"]["walls"], prior)
    matter = sum(rare(name, prior) for name in names) / max(len(names), 1)
    jets = sum(map(_crowded, data["objects"]))
    pull = RARE * (gravity is None and not customary(data, prior))
    laws = _laws(data["objects"], law)
    odd = sum(_odd(thing, prior) for thing in data["objects"])
    spins = sum(map(_starting, data["objects"]))
    belts = sum(_still(thing, prior) for thing in data["objects"])
    known = matter + extra + walls + jets + pull + laws + odd + spins + belts
    return known + _astray(data, gravity)


def customary(data: Data, prior: Prior) -> bool:
    """Whether the gravity of a scene is one that many scenes share.

    Three of four have that of the earth exactly, and hardly one what is near to it.
    """
    gravity = list(data["environment"]["gravity"])
    return any(list(usual["value"]) == gravity for usual in prior.gravities)


def _uneven(walls: Data, prior: Prior) -> float:
    """Walls have one of a handful of frictions."""
    friction: float = walls["friction"]
    return UNEVEN * abs(friction - prior.usual_friction(walls))


def passing(data: Data, prior: Prior) -> float:
    """Loss that makes up for what a scene may have on the way only, not in the end.

    Numbers that are found together pass through frictions of walls that none has.
    """
    walls = data["environment"]["walls"]
    usual: bool = walls["friction"] == prior.usual_friction(walls)
    return 0.0 if usual else ODD_WALLS


def _laws(things: Sequence[Data], walls: str) -> float:
    """Colliders mostly are of the usual law, or all of that of the walls."""
    laws = {thing["contact"]["type"] for thing in things if "contact" in thing}
    if laws <= {USUAL_LAW}:
        return 0.0
    return rarity(ALL_ALIKE if laws == {walls} else MIXED)


def _odd(thing: Data, prior: Prior) -> float:
    """Numbers of materials are mostly near to those of a class, or a kind of it."""
    numbers = thing.get("physics_properties")
    if numbers is None:
        return 0.0
    name = numbers["constitutive_model"]
    kinds = [UNCOMMON + _distance(numbers, prior.typical(k)) for k in prior.kinds(name)]
    return ODD * min([_distance(numbers, prior.typical(name)), *kinds])


def _starting(thing: Data) -> float:
    """Half of all bodies are at rest at first; what spins moves, and none is slow."""
    state = thing.get("initial_state")
    if state is None:
        return 0.0
    speed, spin = math.hypot(*state["velocity"]), abs(state["angular_velocity"])
    crept = rarity(NONE) if 0.0 < speed < LEAST_SPEED else 0.0
    if not spin:
        return crept
    spun = rarity(SPINNING) if speed and spin > LEAST_SPIN else rarity(NONE)
    return crept + spun


def _still(thing: Data, prior: Prior) -> float:
    """Nearly all capsules that stay where they are are belts, and hardly any circle."""
    belt = thing.get("kinematics", {}).get("type") == "conveyor"
    if not belt and thing["object_type"] != "static_collider":
        return 0.0
    share = prior.belt_share(thing)
    return rarity(max(share if belt else 1.0 - share, NONE))


def _distance(numbers: Data, usual: Data) -> float:
    """Squared deviations of the numbers of a material from usual ones, together."""
    return sum(
        min((math.log(numbers[key] / value) / SPREADS.get(key, SPREAD)) ** 2, ODDEST)
        for key, value in usual.items()
        if isinstance(value, float) and value > 0.0 and numbers[key] > 0.0
    )


def _crowded(thing: Data) -> float:
    """What is poured is about as dense as most: rate and width trade for each other."""
    emission = thing.get("emission")
    if emission is None:
        return 0.0
    width, speed = thing["shape"]["size"][0], math.hypot(*emission["velocity"])
    dense = crowding(emission["type"], emission["rate"], width, max(speed, 0.01))
    return THIN * dense**2


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
