"""The shape of a mask: fits of all kinds, and the choice among them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from mpmworlds.baselines.search.outlines import Outline
from mpmworlds.baselines.search.perception.forms import Start, polygons, starts
from mpmworlds.baselines.search.perception.pixels import Data, Mask, Pixels, Seen
from mpmworlds.baselines.search.perception.simplex import descend
from mpmworlds.baselines.search.perception.templates import outlined

# A kind of more freedom must fit better by so much overlap.
HANDICAP: Final = {
    "circle": 0.0,
    "box": 0.004,
    "ellipse": 0.006,
    "capsule": 0.006,
    "ring": 0.004,
    "fan_blades": 0.008,
    "rounded_box": 0.010,
}
OBLONG: Final = 1.2  # ratio of axes of what is no circle: in train 1.37 or more
ROUNDED: Final = 0.85  # part of a side that is round
NO_CIRCLE: Final = 0.05  # overlap that tells what is round from a circle; none is so
PER_CORNER: Final = 0.0035
USUAL: Final = 0.01  # the same of a polygon of a usual outline
WELL: Final = 0.95  # overlap of one after which others are not tried
MOST_CORNERS: Final = 16
GOOD: Final = 0.975  # overlap after which polygons of more corners are not tried
UPRIGHT: Final = 0.6  # degrees from an axis that nobody meant
MANY: Final = 8  # corners that are moved one by one


@dataclass(frozen=True)
class Fit:
    """A shape that was fitted to a mask."""

    shape: Data
    """Plain data."""
    iou: float
    """Overlap with the mask."""
    usual: bool = False
    """Whether it is a polygon of a usual outline."""


def fit_shape(
    mask: Mask,
    pixels: Pixels,
    grown: float = 0.0,
    care: Mask | None = None,
    kinds: Sequence[str] = (),
    outlines: Sequence[Outline] = (),
) -> Fit:
    """The shape that a mask most likely is.

    Parameters
    ----------
    mask, care
        Pixels of the thing (N, N), and those that tell anything.
    pixels
        Where they are.
    grown
        By how much it is drawn larger than it is [m].
    kinds
        Types that it may have; any if empty.
    outlines
        That polygons often have.
    """
    seen = Seen(mask, care, pixels)
    fits = [_fitted(start, seen, grown) for start in starts(mask, pixels, kinds)]
    best = max((f.iou for f in fits), default=0.0)
    if not kinds or "polygon" in kinds:
        usual = [
            replace(_fitted(start, seen, grown), usual=True)
            for start in outlined(mask, pixels, outlines)
        ]
        fits += usual
        well = max((f.iou for f in usual), default=0.0) > WELL
        for start in () if well else polygons(mask, pixels, MOST_CORNERS):
            if best > GOOD and len(start.numbers) > 8 and not kinds:
                break
            fits.append(_fitted(start, seen, grown))
            best = max(best, fits[-1].iou)
    if not fits:
        raise ValueError("no shape of the kinds asked for fits the mask")
    return _upright(max(fits, key=_merit), seen, grown)


def _upright(fit: Fit, seen: Seen, grown: float) -> Fit:
    """The shape with edges along the axes, if it is nearly so and fits as well."""
    degrees = fit.shape.get("angle_deg", 0.0)
    nearest = 90.0 * round(degrees / 90.0)
    if degrees == nearest or abs(degrees - nearest) > UPRIGHT:
        return fit
    shape = fit.shape | {"angle_deg": nearest}
    iou = seen.iou(shape, grown)
    return replace(fit, shape=shape, iou=iou) if iou > fit.iou - 0.002 else fit


def _merit(fit: Fit) -> float:
    kind = fit.shape["type"]
    if fit.usual:
        return fit.iou - USUAL
    if kind == "polygon":
        return fit.iou - PER_CORNER * len(fit.shape["vertices"])
    return fit.iou - HANDICAP[kind] - (NO_CIRCLE if _is_round(fit.shape) else 0.0)


def _is_round(shape: Data) -> bool:
    """Whether it is an ellipse or a rounded box that is meant for a circle."""
    lengths = shape.get("semi_axes") or shape.get("size") or (1.0, 0.0)
    if max(lengths) > OBLONG * min(lengths):
        return False
    radius = shape.get("corner_radius", 0.0)
    return bool(shape["type"] == "ellipse" or 2.0 * radius > ROUNDED * min(lengths))


def _fitted(start: Start, seen: Seen, grown: float) -> Fit:
    steps = np.array(start.steps)
    free = steps > 0.0
    numbers = np.array(start.numbers)

    def built(x: np.ndarray) -> Data:
        v = numbers.copy()
        v[free] = x
        return start.build(v.tolist())

    calls = 45 * int(free.sum())
    if start.kind == "polygon" and len(numbers) > 2 * MANY:
        calls = 1  # the contour itself
    _, x = descend(
        lambda v: seen.misfit(built(v), grown), numbers[free], steps[free], calls
    )
    shape = built(x)
    try:
        return Fit(shape, seen.iou(shape, grown))
    except ValueError:  # no valid shape, as corners that cross
        return Fit(start.build(start.numbers), 0.0)
