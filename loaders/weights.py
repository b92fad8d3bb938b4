"""How often a training sample is to be seen: the weights by which `10k` is drawn.

There are nine perturbations for every template, and they are much alike; the weights
favour templates. The rows of `10k` have been drawn by them already.
"""

from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Final

import yaml

from mpmworlds.splits.lists import ListParams

PROFILE: Final = "full"  # whose lists have the weights


@cache
def weights_by_kind() -> Mapping[str, float]:
    """Kind of a sample -> its weight [1], as in `params.yaml`."""
    params = yaml.safe_load(files("mpmworlds").joinpath("params.yaml").read_text())
    lists = ListParams.from_params(params, PROFILE)
    if lists is None:
        raise ValueError(f"params.yaml: profile {PROFILE!r} has no lists, must have")
    return MappingProxyType({k: float(w) for k, w in lists.weights.items()})


def sampling_weights(kinds: Iterable[str]) -> list[float]:
    """Weights of samples, given the column `kind` of their rows."""
    by_kind = weights_by_kind()
    return [by_kind[kind] for kind in kinds]
