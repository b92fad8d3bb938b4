"""How dense, wide and swinging most nozzles of the train split are."""

import math
from collections.abc import Mapping
from typing import Final

from mpmworlds.baselines.search.perception.flow import SPACING

DENSE: Final = 0.85  # of the densest jet: how dense most are
# How dense most are, and the deviation of its logarithm, in the train split.
USUAL: Final = {
    "jet": (DENSE, 0.18),
    "hose": (DENSE, 0.18),
    "rain": (0.058, 0.3),
    "drizzle": (0.21, 0.3),
}
DRIZZLE: Final = 0.5  # speed below which rain is narrow and dense [m/s]
# Misfit that one is worth which is so much denser, or less.
CROWDED: Final = {"jet": 0.01, "hose": 0.01, "rain": 0.001}
# Widths [m] and the deviations of their logarithms.
WIDE: Final = {"rain": (0.39, 0.3), "drizzle": (0.13, 0.25)}
SWING: Final = (24.0, 6.0)  # of hoses and its deviation [deg]


def unusual(kind: str, v: Mapping[str, float]) -> float:
    """Misfit that makes up for how unusually dense or narrow one is."""
    speed = max(abs(v["speed"]), 0.06)
    deviations = crowding(kind, math.exp(v["rate"]), math.exp(v["width"]), speed) ** 2
    if kind == "rain":
        usual, spread = WIDE[_sort(kind, speed)]
        deviations += ((v["width"] - math.log(usual)) / spread) ** 2
    if kind == "hose":
        usual, spread = SWING
        deviations += ((abs(v["swing"]) - usual) / spread) ** 2
    return CROWDED[kind] * deviations


def _sort(kind: str, speed: float) -> str:
    """Kind of a nozzle, or `drizzle`: slow rain is of another width and density."""
    return "drizzle" if kind == "rain" and speed < DRIZZLE else kind


def crowding(kind: str, rate: float, width: float, speed: float) -> float:
    """How much denser than most of its kind one is, in standard deviations.

    Rate [1/s], width [m] and speed [m/s] trade against each other in what is seen.
    """
    usual, spread = USUAL[_sort(kind, speed)]
    return math.log(rate * SPACING**2 / (usual * width * speed)) / spread
