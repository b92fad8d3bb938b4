"""The minimiser of fits: downhill simplex from a start with known steps.

SciPy has one; the core of the package does without it, and this is all that search
would take from it.
"""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Cost = Callable[[Floats], float]

NO_VALUE = 1e3  # cost where there is none
CONVERGED = 1e-5  # spread of the costs of all corners, relative to their size


def descend(
    cost: Cost,
    start: Sequence[float] | Floats,
    steps: Sequence[float] | Floats,
    calls: int,
) -> tuple[float, Floats]:
    """Least cost found, and where [Nelder and Mead 1965].

    Parameters
    ----------
    cost
        What is to be small; it may raise `ValueError` where it has no value.
    start, steps
        First corner (n,) of the simplex, and how far the others are from it.
    calls
        About how often the cost is asked for.
    """
    left = calls

    def value(x: Floats) -> float:
        nonlocal left
        left -= 1
        try:
            return float(cost(x))
        except ValueError:
            return NO_VALUE

    first = np.asarray(start, np.float64)
    corners = np.vstack([first, first + np.diag(np.asarray(steps, np.float64))])
    costs = np.array([value(corner) for corner in corners])
    while left > 0:
        order = np.argsort(costs, kind="stable")
        corners, costs = corners[order], costs[order]
        if costs[-1] - costs[0] <= CONVERGED * (abs(costs[0]) + CONVERGED):
            break
        middle = corners[:-1].mean(axis=0)
        away = middle - corners[-1]
        tried = middle + away
        got = value(tried)
        if got < costs[0]:
            further = middle + 2.0 * away
            if (there := value(further)) < got:
                tried, got = further, there
        elif got >= costs[-2]:
            part = 0.5 if got < costs[-1] else -0.5
            tried = middle + part * away
            got = value(tried)
            if got >= costs[-1]:
                corners[1:] = 0.5 * (corners[1:] + corners[0])
                costs[1:] = [value(corner) for corner in corners[1:]]
                continue
        corners[-1], costs[-1] = tried, got
    best = int(np.argmin(costs))
    return float(costs[best]), corners[best]
