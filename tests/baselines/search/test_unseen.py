"""Candidates differ in what the prefix does not show; its losses order them."""

import math

import pytest

from mpmworlds.baselines.search.prior import LATEST, prior
from mpmworlds.baselines.search.trials.readings import Trial
from mpmworlds.baselines.search.unseen import proposals, variants
from tests.baselines.search.worlds import world

END = 0.74


def scene():
    data = world("ball", "gate", "jet").to_data()
    data["objects"][1]["kinematics"]["stop"] = 1.0
    return data


def test_variants_differ_only_after_the_prefix():
    data, usual = scene(), prior()
    found = [changed for _, changed in variants(data, usual, END)]
    assert len(found) == 2
    for changed, part, stop in zip(found, (0.75, 0.25), (2, 0), strict=True):
        gate, jet = changed["objects"][1]["kinematics"], changed["objects"][2]
        speed, start = math.hypot(*gate["velocity"]), gate["start"]
        way = usual.way(speed, speed * (END - start), part)
        assert gate["stop"] == pytest.approx(max(start + way / speed, END + LATEST))
        assert jet["emission"]["stop"] == usual.emission_stops["jet"][stop]
        gate["stop"] = 1.0
        jet["emission"]["stop"] = data["objects"][2]["emission"]["stop"]
        assert changed == data


def test_nothing_is_open_where_all_has_stopped():
    data = world("ball", "gate").to_data()  # the gate stops within the prefix
    assert list(variants(data, prior(), END)) == []


class Tried:
    """A search that has come to some trials."""

    def __init__(self, trials):
        self.trials = trials

    def candidates(self, count):
        return self.trials[:count]


def test_what_is_as_good_comes_first_then_what_is_open_then_the_rest():
    best, near, far = (Trial(loss, scene(), str(loss)) for loss in (0.1, 0.11, 0.3))
    found = proposals(Tried([best, near, far]), prior(), END, 4)
    assert [trial.loss for trial in found] == [0.1, 0.11, 0.1, 0.1, 0.3]
    assert found[0] is best
    assert len({str(trial.data) for trial in found[2:4]} | {str(best.data)}) == 3
