"""Numbers and names of single objects."""

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.recipes.objects import renamed, rounded, weighted
from tests.sim.scenes import BOWL, EGG


@given(st.floats(-1e6, 1e6))
def test_rounded_numbers_are_short_and_near(value):
    assert rounded(value) == pytest.approx(value, rel=5e-4, abs=5e-5)
    assert rounded(rounded(value)) == rounded(value)


def test_weights_need_not_add_up_to_one():
    rng = np.random.default_rng(0)
    drawn = [weighted(rng, {"a": 6.0, "b": 2.0, "c": 0.0}) for _ in range(400)]
    assert 0.68 < drawn.count("a") / len(drawn) < 0.82
    assert "c" not in drawn


def test_renamed_objects_are_copies_with_neutral_names():
    before = [copy.deepcopy(EGG), copy.deepcopy(BOWL)]
    after = renamed(before)
    assert [thing["name"] for thing in after] == ["object_0", "object_1"]
    after[0]["shape"]["center"][0] = 9.0
    assert before == [EGG, BOWL]
