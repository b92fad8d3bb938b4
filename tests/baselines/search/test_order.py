"""Drops are numbered, those that are not seen too."""

import numpy as np
import pytest

from mpmworlds.baselines.search.perception.order import numbered

SEEN = 0.76  # how long the nozzle was seen [s]


def births(gap, numbers, start=0.0):
    return np.array([start + gap * (number + 0.5) for number in numbers])


@pytest.mark.parametrize(
    "numbers", [[0, 1, 2], [0, 2], [0, 2, 3]], ids=["all", "one cut", "the second cut"]
)
def test_drops_that_were_cut_are_counted(numbers):
    found, gap = numbered(births(0.14, numbers), np.zeros(len(numbers)), SEEN)
    assert gap == pytest.approx(0.14)
    assert found.tolist() == numbers


def test_the_drop_after_one_that_stands_alone_may_have_been_cut():
    _, gap = numbered(births(0.16, [0]), np.zeros(1), SEEN)
    assert gap == pytest.approx(0.16)


def test_the_drop_after_a_late_one_is_not_born_yet():
    _, gap = numbered(np.array([0.48]), np.zeros(1), SEEN)
    assert gap == pytest.approx(0.48)
