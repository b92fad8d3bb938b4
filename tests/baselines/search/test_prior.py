"""The table of what is usual, counted from scenes."""

import copy
import math

import pytest

from mpmworlds.baselines.search.counting import FAR, counted
from mpmworlds.baselines.search.prior import prior
from mpmworlds.sim.scene.objects import MATERIALS
from tests.baselines.search.worlds import world


def liquids(viscosities):
    """Scenes of one liquid ball each."""
    scene = world("ball", "gate", "jet").to_data()
    for viscosity in viscosities:
        changed = copy.deepcopy(scene)
        numbers = prior().typical("liquid") | {"viscosity": viscosity}
        changed["objects"][0]["physics_properties"] = numbers
        changed["objects"][2]["physics_properties"] = dict(numbers)
        yield changed


# Each class must occur, so that it has a median.
def all_classes():
    scene = world("ball").to_data()
    for name in sorted(MATERIALS):
        changed = copy.deepcopy(scene)
        changed["objects"][0]["physics_properties"] = prior().typical(name)
        yield changed


def test_a_kind_of_a_class_is_what_some_have_far_from_the_others():
    table = counted([*all_classes(), *liquids([0.05] * 40 + [4.0, 5.0, 6.0])])
    assert table.typical("liquid")["viscosity"] == 0.05
    assert table.kinds("liquid") == ["liquid:0"]
    assert table.typical("liquid:0")["viscosity"] == 5.0
    assert table.typical("liquid:0")["constitutive_model"] == "liquid"


def test_one_that_stands_alone_is_no_kind():
    table = counted([*all_classes(), *liquids([0.05] * 200 + [5.0])])
    assert table.kinds("liquid") == []


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_kinds_of_the_recorded_table_are_far_from_the_typical_one(name):
    usual = prior().typical(name)
    for kind in prior().kinds(name):
        numbers = prior().typical(kind)
        assert numbers.keys() == usual.keys()
        assert any(
            max(numbers[k], usual[k]) > FAR * min(numbers[k], usual[k])
            for k in usual
            if isinstance(usual[k], float)
        )


def test_capsules_that_stay_are_belts_and_circles_hardly_ever():
    belts = prior().belts
    assert belts["capsule"] == 1.0
    assert belts["circle"] < 0.01 < belts["box"] < 0.5


def test_contacts_are_counted_by_shape_and_motion():
    scene = world("still", "gate", "ball").to_data()
    changed = copy.deepcopy(scene)
    changed["objects"][0]["contact"] |= {"type": "sticky", "friction": 0.6}
    table = counted([*all_classes(), *liquids([0.05]), scene, changed, changed])
    still = scene["objects"][0]
    assert table.contact_of(still)["type"] == "sticky"
    assert table.contact_of(still)["friction"] == 0.6
    assert table.contact_of(scene["objects"][1]) == scene["objects"][1]["contact"]
    unknown = still | {"shape": {"type": "capsule"}}
    assert table.contact_of(unknown) == table.contact
    assert (table.belts["ellipse"], table.belt_speed) == (0.0, 0.0)


def test_ways_go_by_speed_and_by_what_is_seen():
    usual = prior()
    for speed in (0.01, 0.09, 0.12, 0.4, 5.0):
        ways = [usual.way(speed, 0.0, part) for part in (0.0, 0.25, 0.5, 0.75, 1.0)]
        assert ways == sorted(ways)
        middle = usual.way(speed, 0.0, 0.5)
        assert usual.way(speed, middle, 0.5) == pytest.approx(ways[3])
        assert usual.way(speed, 2.0, 0.5) == 2.0  # farther than any that is known
    # What creeps is known to stop soon, what is a little faster is not.
    assert usual.way(0.09, 0.05, 0.5) < 0.6 * usual.way(0.13, 0.05, 0.5)


def test_ways_and_stops_are_counted():
    scene = world("ball", "gate", "jet").to_data()
    table = counted([*all_classes(), scene])
    motion = scene["objects"][1]["kinematics"]
    speed = math.hypot(*motion["velocity"])
    way = speed * (motion["stop"] - motion["start"])
    assert table.way(2.0 * speed, 0.0, 0.5) == pytest.approx(way, rel=1e-3)
    stop = scene["objects"][2]["emission"]["stop"]
    assert table.emission_stops == {"jet": [stop] * 3}
