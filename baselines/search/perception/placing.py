"""Where a shape is whose size is known: its center and angle."""

from typing import Final

import numpy as np

from mpmworlds.baselines.search.perception.pixels import Data, Mask, Pixels, Seen
from mpmworlds.baselines.search.perception.shapes import Fit
from mpmworlds.baselines.search.perception.simplex import descend
from mpmworlds.sim.scene.objects import SHAPES
from mpmworlds.sim.scene.outlines import centroid

ANGLES: Final = 24  # that fits start from
BEST: Final = 3  # starts that are followed


def place_shape(
    mask: Mask, pixels: Pixels, told: Data, grown: float = 0.0, care: Mask | None = None
) -> Fit:
    """Center and angle of a shape in plain data that lacks them."""
    seen = Seen(mask, care, pixels)
    middle = pixels.centroid(mask)
    turns = "angle_deg" in SHAPES[told["type"]].model_fields
    trials = []
    for angle in np.arange(0.0, 360.0, 360.0 / ANGLES) if turns else (0.0,):
        placed = _placed(told, [*middle, angle], turns=turns)
        # Pixels are around the center of area, which may lie aside of the center.
        model = SHAPES[told["type"]].model_validate(placed)
        aside = centroid(model.outline()) - np.array(placed["center"])
        numbers = [*(middle - aside), angle]
        trials.append(
            (seen.misfit(_placed(told, numbers, turns=turns), grown), numbers)
        )
    trials.sort(key=lambda pair: pair[0])
    step = 1.0 / pixels.side
    best: tuple[float, Data] | None = None
    for _, numbers in trials[:BEST]:
        count = 3 if turns else 2
        error, x = descend(
            lambda v: seen.misfit(_placed(told, v, turns=turns), grown),
            numbers[:count],
            [2 * step, 2 * step, 4.0][:count],
            120,
        )
        if best is None or error < best[0]:
            best = error, _placed(told, x, turns=turns)
    assert best is not None
    return Fit(best[1], seen.iou(best[1], grown))


def _placed(told: Data, numbers: "np.ndarray | list[float]", *, turns: bool) -> Data:
    placed = told | {"center": [float(numbers[0]), float(numbers[1])]}
    if turns:
        placed["angle_deg"] = float(np.remainder(numbers[2] + 180.0, 360.0) - 180.0)
    return placed
