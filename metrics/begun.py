"""How good a prediction can still become of which only the beginning is known.

A candidate that cannot win any more need not be computed to its end.
"""

from collections.abc import Callable

from mpmworlds.metrics.clips import Clip, Curve
from mpmworlds.metrics.view import View

Bound = Callable[[View, View], float]


def first(ref: View, count: int) -> View:
    """The first frames of a reference, cut off once for all that is compared."""
    return ref.once(_beginnings).setdefault(
        count, View(ref.clip[:count], "reference", ref.constants)
    )


def _beginnings(_ref: View) -> dict[int, View]:
    return {}


def bound_of_mean(curve: Callable[[Clip | View, Clip | View], Curve]) -> Bound:
    """Bound of a distance that is the mean of a curve over the frames: 0 from now on.

    Parameters
    ----------
    curve : callable
        Distance of every frame, (T,), of two clips of equal shape.

    Returns
    -------
    callable
        Of the first frames of a prediction and the whole reference.
    """

    def bound(begun: View, ref: View) -> float:
        known, total = begun.shape[0], ref.shape[0]
        return float(curve(begun, first(ref, known)).sum() / total)

    return bound
