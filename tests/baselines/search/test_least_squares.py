"""Numbers that trade against each other are found together, in few runs."""

import numpy as np
import pytest

from mpmworlds.baselines.search.trials.least_squares import Point, fit_together
from mpmworlds.baselines.search.trials.moves import Move


def shifting(name, step, least=-np.inf):
    def change(data, by):
        data[name] = max(data[name] + by, least)

    return Move(name, step, 1.0, change)


class World:
    """A curved valley: what one number does wrong the other nearly mends."""

    def __init__(self, **truth):
        self.truth, self.runs = self.drawn(truth), []

    @staticmethod
    def drawn(data):
        x, y, z = (data[name] for name in "xyz")
        t = np.linspace(0.0, 1.0, 30)
        return np.array(x * t + y * np.sin(t) + 0.3 * x * y * t**2 + 0.02 * z)

    def point(self, data, what=""):
        self.runs.append(what)
        residual = (self.drawn(data) - self.truth).astype(np.float32)
        return Point(data, float(np.abs(residual).mean()), residual)


def fitted(world, moves, start, looks=3):
    return fit_together(world.point(start), moves, world.point, lambda: True, looks)


MOVES = [shifting("x", 0.3), shifting("y", 0.3), shifting("z", 0.3)]


def test_a_valley_is_gone_along_in_few_runs():
    world = World(x=0.8, y=-0.4, z=0.2)
    start = world.point({"x": 0.0, "y": 0.0, "z": 0.0})
    best = fitted(world, MOVES, start.data)
    assert best.loss < 0.02 * start.loss
    assert len(world.runs) < 20
    assert start.data == {"x": 0.0, "y": 0.0, "z": 0.0}


def test_a_number_at_the_end_of_its_range_stays_and_the_others_do_not():
    world = World(x=-0.2, y=0.5, z=0.0)
    bound = [shifting("x", 0.3, least=0.0), shifting("y", 0.3)]
    best = fitted(world, bound, {"x": 0.0, "y": 0.0, "z": 0.0})
    assert best.data["x"] == 0.0
    assert 0.1 < best.data["y"] < 0.5


def test_what_cannot_be_run_is_no_step():
    world = World(x=0.8, y=0.0, z=0.0)

    def tried(data, what):
        if data["z"] > 0.1:
            return Point(data, 2.0, None)
        return world.point(data)

    start = world.point({"x": 0.0, "y": 0.0, "z": 0.0})
    best = fit_together(start, MOVES, tried, lambda: True, 2)
    assert best.loss < start.loss
    assert best.residual is not None


@pytest.mark.parametrize("left", [True, False])
def test_it_looks_only_while_something_is_left(left):
    world = World(x=0.8, y=0.0, z=0.0)
    start = world.point({"x": 0.0, "y": 0.0, "z": 0.0})
    best = fit_together(start, MOVES, world.point, lambda: left, 1)
    assert (best.loss < start.loss) is left
    assert (len(world.runs) > 1) is left
