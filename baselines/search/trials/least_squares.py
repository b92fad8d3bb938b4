"""All numbers of a scene at once, by least squares of what is drawn.

Numbers trade against each other: friction against gravity, stiffness against speed. A
search along one after the other creeps; here each is moved a little, and what that does
to the coarse pictures says how to move all of them together (Levenberg 1944, Marquardt
1963; between two looks at everything the rank-one update of Broyden 1965).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.trials.moves import Data, Move

Vector = npt.NDArray[np.float64]

FARTHEST: Final = 3.0  # first steps of a number that one step may take
USUAL: Final = 3.0  # first steps that a number is off, if nothing tells
FREEDOM: Final = 60.0  # numbers that pictures tell apart, about
DAMPINGS: Final = (1.0, 12.0)  # one after the other, until a step helps
PROBE: Final = 0.5  # part of a first step that each number is moved by at first
SHIFTED: Final = 0.4  # part of what is missed that moving a number is to change, later
SMALLEST: Final = 0.02  # part of a first step that tells a slope from noise
WORTHWHILE: Final = 0.03  # part of the loss that a step must save for another one
LEAST: Final = 1e-6  # what is missed at least, so that all can be solved for
UPDATES: Final = 2  # steps between two looks at everything


@dataclass(frozen=True)
class Point:
    """A scene that was run."""

    data: Data
    """Plain data."""
    loss: float
    """Its loss."""
    residual: npt.NDArray[np.float32] | None
    """What is to become small; None if the scene cannot be run."""


Tried = Callable[[Data, str], Point]
"""Runs a scene, which is called so."""


def fit_together(
    start: Point,
    moves: Sequence[Move],
    tried: Tried,
    going: Callable[[], bool],
    looks: int,
) -> Point:
    """Change all numbers of a scene together while that lowers its loss.

    Parameters
    ----------
    start
        The scene.
    moves
        What may be changed.
    tried
        Runs a scene.
    going
        Asked before each look at everything whether to go on.
    looks
        How many times at most everything is looked at.

    Returns
    -------
    Point
        The best scene.
    """
    best, probes = start, [PROBE] * len(moves)
    for _ in range(looks if moves else 0):
        if best.residual is None or not going():
            break
        before = best.loss
        slopes = _slopes(best, moves, tried, probes)
        probes = _probes(best, slopes)
        for _ in range(UPDATES + 1):
            last, found = best.loss, _step(best, moves, slopes, tried)
            if found is None:
                break
            best = found
            if last - best.loss < WORTHWHILE * last:
                break
        if before - best.loss < WORTHWHILE * before:
            break
    return best


def _probes(at: Point, slopes: Vector) -> list[float]:
    """How far to move each number so that pictures change alike."""
    assert at.residual is not None
    wanted = SHIFTED * float(np.linalg.norm(at.residual))
    steep = np.maximum(np.linalg.norm(slopes, axis=1), 1e-9)
    return [float(by) for by in np.clip(wanted / steep, SMALLEST, PROBE)]


def _slopes(
    at: Point, moves: Sequence[Move], tried: Tried, probes: Sequence[float]
) -> Vector:
    """Change of the residual with each number, in its first steps: (numbers, parts)."""
    assert at.residual is not None
    slopes = np.zeros((len(moves), len(at.residual)))
    for k, move in enumerate(moves):
        for by in (probes[k], -probes[k]):
            moved = move.of(at.data, by * move.step)
            if moved == at.data:  # a number at the end of its range
                continue
            residual = tried(moved, move.what).residual
            if residual is not None:
                slopes[k] = (residual - at.residual) / by
                break
    return slopes


def _step(
    at: Point, moves: Sequence[Move], slopes: Vector, tried: Tried
) -> Point | None:
    """A better scene, if one is found; the slopes are brought up to date."""
    assert at.residual is not None
    residual = at.residual.astype(float)
    for damping in DAMPINGS:
        way = _way(at.data, moves, slopes, residual, damping)
        data = at.data
        for move, by in zip(moves, way, strict=True):
            if by:
                data = move.of(data, float(by) * move.step)
        found = tried(data, "all numbers")
        if found.residual is not None:
            missed = found.residual - residual - way @ slopes
            slopes += np.outer(way, missed) / max(float(way @ way), 1e-9)
        if found.loss < at.loss:
            return found
    return None


def _way(
    data: Data, moves: Sequence[Move], slopes: Vector, residual: Vector, damping: float
) -> Vector:
    """How far each number is to go, in its first steps; none beyond its range."""
    missed = max(float(residual @ residual), LEAST)
    noise = damping * missed / FREEDOM / USUAL**2
    free: npt.NDArray[np.bool_] = np.array(slopes.any(axis=1))
    while True:
        some = slopes[free]
        normal = some @ some.T + noise * np.eye(len(some))
        way = np.zeros(len(moves))
        way[free] = np.clip(
            np.linalg.solve(normal, -some @ residual), -FARTHEST, FARTHEST
        )
        stuck = [
            k
            for k, move in enumerate(moves)
            if way[k] and move.of(data, float(way[k]) * move.step) == data
        ]
        if not stuck:
            return way
        free[stuck] = False
