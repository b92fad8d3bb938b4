"""The minimiser of costs with many hollows: covariance matrix adaptation.

The package `cma` has all variants of it; the core of the package does without it, and
fits of nozzles have at most ten numbers and a few hundred values.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def evolve(
    cost: Callable[[Floats], float],
    start: Sequence[float] | Floats,
    steps: Sequence[float] | Floats,
    calls: int,
    seed: int,
) -> tuple[float, Floats]:
    """Least cost found, and where [Hansen 2016, arXiv 1604.00772, default settings].

    Parameters
    ----------
    cost
        What is to be small.
    start, steps
        Mean (n,) and standard deviations at first.
    calls
        Largest number of values.
    seed
        Which draws.
    """
    mean, scale = np.asarray(start, np.float64), np.asarray(steps, np.float64)
    n = len(mean)
    generator = np.random.Generator(np.random.Philox(seed))
    children = 4 + int(3 * math.log(n))
    parents = children // 2
    weights = math.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    weights /= weights.sum()
    effective = 1.0 / float((weights**2).sum())
    c_step = (effective + 2) / (n + effective + 5)
    damping = 1 + 2 * max(0.0, math.sqrt((effective - 1) / (n + 1)) - 1) + c_step
    c_path = (4 + effective / n) / (n + 4 + 2 * effective / n)
    c_one = 2 / ((n + 1.3) ** 2 + effective)
    c_many = min(
        1 - c_one, 2 * (effective - 2 + 1 / effective) / ((n + 2) ** 2 + effective)
    )
    expected = math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n**2))
    covariance, sigma = np.eye(n), 1.0
    path, step_path = np.zeros(n), np.zeros(n)
    best = float(cost(mean)), mean
    for generation in range(1, max((calls - 1) // children, 1) + 1):
        values, axes = np.linalg.eigh(covariance)
        spread = np.sqrt(np.maximum(values, 1e-14))
        drawn = generator.standard_normal((children, n)) * spread @ axes.T
        points = mean + scale * sigma * drawn
        costs = np.array([cost(point) for point in points])
        order = np.argsort(costs, kind="stable")[:parents]
        if costs[order[0]] < best[0]:
            best = float(costs[order[0]]), points[order[0]]
        step = weights @ drawn[order]
        mean = mean + scale * sigma * step
        white = axes @ ((axes.T @ step) / spread)
        step_path = (1 - c_step) * step_path + math.sqrt(
            c_step * (2 - c_step) * effective
        ) * white
        length = float(np.linalg.norm(step_path))
        slow = length / math.sqrt(1 - (1 - c_step) ** (2 * generation)) < (
            (1.4 + 2 / (n + 1)) * expected
        )
        path = (1 - c_path) * path + slow * math.sqrt(
            c_path * (2 - c_path) * effective
        ) * step
        rank_many = (weights[:, None] * drawn[order]).T @ drawn[order]
        covariance = (
            (1 - c_one - c_many) * covariance
            + c_one * np.outer(path, path)
            + c_many * rank_many
        )
        sigma *= math.exp(c_step / damping * (length / expected - 1))
    return best
