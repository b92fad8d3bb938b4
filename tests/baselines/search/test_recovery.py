"""Scenes that were found are compared with the truth, thing by thing."""

import pytest

from mpmworlds.baselines.search.recovery import (
    SAME_PREFIX,
    apart_in_prefix,
    matches,
    table,
)
from tests.baselines.search.worlds import FORM, checked, prefix_of, world


def test_the_truth_is_right_in_everything():
    truth = world("brick", "jet", "fan").to_data()
    for match in matches(truth, truth):
        assert (match.type, match.place) == (1.0, 0.0)
        assert {match.shape, match.material} <= {1.0, None}
        assert match.numbers in (0.0, None)


def test_each_error_is_counted_where_it_is():
    truth = world("brick", "jet", "fan").to_data()
    found = world("brick", "jet").to_data()
    found["objects"].reverse()
    brick = found["objects"][1]
    brick["shape"]["center"] = [0.4, 0.72]
    brick["initial_state"]["velocity"] = [0.3, 1.0]
    brick["physics_properties"]["youngs_modulus"] *= 2.0
    one, two, three = matches(truth, found)
    assert (one.place, one.speed) == pytest.approx((0.03, 0.4))
    assert one.numbers > 0.0
    assert two.numbers == 0.0
    assert (three.type, three.shape, three.place) == (0.0, None, None)
    rows = table([one, two, three]).splitlines()
    assert [row.split(" | ")[0] for row in rows[2:]] == [
        "| elastic",
        "| kinematic_collider",
        "| liquid",
        "| all",
    ]


def test_what_a_prefix_cannot_tell_is_said_to_be_so():
    """A body that only flies: its material does not show, its velocity does."""
    scene = world("ball", gravity=(0.0, -1.0))
    softer, faster = scene.to_data(), scene.to_data()
    softer["objects"][0]["physics_properties"]["poissons_ratio"] = 0.22
    faster["objects"][0]["initial_state"]["velocity"] = [0.2, 0.0]
    seen = prefix_of(scene)
    assert apart_in_prefix(seen, FORM, checked(softer)) < SAME_PREFIX
    assert apart_in_prefix(seen, FORM, checked(faster)) > SAME_PREFIX
