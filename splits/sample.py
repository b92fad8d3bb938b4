"""Weighted samples without replacement that stay put as the corpus grows.

Source: Efraimidis and Spirakis 2006, "Weighted random sampling with a reservoir",
Information Processing Letters 97(5), algorithm A, with draws that belong to the ids.
"""

import math
from collections.abc import Iterable, Mapping, Sequence

from mpmworlds.splits.uniform import uniform


def weighted_sample(
    ids: Iterable[str], weights: Mapping[str, float], n: int, salt: str
) -> list[str]:
    """Choose n ids, heavier ones with higher probability.

    Every id has the key -ln(u) / w, an exponential variable of rate w, with u drawn
    from the id; the n smallest keys are chosen. An id that is added later can displace
    a chosen one but never reorders the others, and a smaller sample is part of a larger
    one.

    Parameters
    ----------
    ids
        Distinct ids to choose from, in any order.
    weights
        Weight of every id, finite and >= 0. [1] An id of weight 0 is never chosen.
    n
        How many ids to choose.
    salt
        Text that tells this sample from others of the same ids.

    Returns
    -------
    list of str
        The chosen ids, sorted.

    Raises
    ------
    ValueError
        If an id repeats, a weight is missing or invalid, or fewer than n ids have a
        positive weight.
    """
    return the_first(weighted_order(ids, weights, salt), n)


def the_first(order: Sequence[str], n: int) -> list[str]:
    """The first n ids of a `weighted_order`, sorted; raises as `weighted_sample`."""
    if not 0 <= n <= len(order):
        raise ValueError(
            f"sample of n = {n}, must be in [0, {len(order)}] "
            "(the number of ids with a positive weight)"
        )
    return sorted(order[:n])


def weighted_order(
    ids: Iterable[str], weights: Mapping[str, float], salt: str
) -> list[str]:
    """All ids of positive weight in the order in which `weighted_sample` takes them."""
    keys: dict[str, float] = {}
    for name in ids:
        if name in keys:
            raise ValueError(f"id {name!r}: occurs twice, must be unique")
        if name not in weights:
            raise ValueError(f"id {name!r}: has no weight, every id needs one")
        weight = weights[name]
        if not (math.isfinite(weight) and weight >= 0):
            raise ValueError(f"id {name!r}: weight {weight}, must be finite and >= 0")
        exponential = -math.log(uniform(salt, "sample", name))
        keys[name] = exponential / weight if weight else math.inf
    return [name for _, name in sorted((k, n) for n, k in keys.items() if k < math.inf)]
