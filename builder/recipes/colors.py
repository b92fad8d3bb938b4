"""Colours of objects: none too near to another, none too dark on black."""

from collections.abc import Sequence
from itertools import combinations
from typing import Final

import numpy as np

from mpmworlds.builder.recipes.objects import Data, NoRoomError
from mpmworlds.sim.scene.palette import PALETTE, hue_difference, luma, saturation

HUE_STEP: Final = 30.0  # hue difference of a new colour from others, if there is one
LEAST_HUE_STEP: Final = 25.0  # and otherwise [deg]
LEAST_LUMA: Final = 64.0  # of a colour on black, of 255
GREY: Final = "#969696"
VIVID: Final = [
    color
    for color in PALETTE.values()
    if saturation(color) > 0.5 and luma(color) >= LEAST_LUMA
]


def confusing(colors: Sequence[str]) -> bool:
    """Whether two colours of a scene have one hue, or one is too dark to be seen."""
    hued = [color for color in colors if saturation(color) > 0.2]
    alike = any(
        hue_difference(one, other) < LEAST_HUE_STEP
        for one, other in combinations(hued, 2)
    )
    return alike or any(luma(color) < LEAST_LUMA for color in colors)


def free_color(rng: np.random.Generator, things: Sequence[Data]) -> str:
    """A vivid palette colour whose hue no coloured object is near.

    Raises
    ------
    NoRoomError
        If there is none.
    """
    used = [thing["visualization"]["color"] for thing in things]
    hued = [color for color in used if saturation(color) > 0.2]
    for step in (HUE_STEP, LEAST_HUE_STEP):
        free = [
            color
            for color in VIVID
            if all(hue_difference(color, other) > step for other in hued)
        ]
        if free:
            return str(rng.choice(free))
    raise NoRoomError(f"no colour is free beside {', '.join(hued)}")
