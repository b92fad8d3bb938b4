"""What is unusual in the train split must be borne out by what is seen."""

import pytest

from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.trials.unusual import unusual
from tests.baselines.search.worlds import world

EARTH = (0.0, -9.8)


def extra(change):
    """How much more a changed scene must save than the usual one."""
    usual = world("brick", "still", "gate", "jet").to_data()
    usual["environment"]["walls"] = {
        "contact": "sticky",
        "friction": 0.3,
        "thickness_cells": 6,
    }
    changed = world("brick", "still", "gate", "jet").to_data()
    changed["environment"]["walls"] = dict(usual["environment"]["walls"])
    change(changed["objects"])
    return unusual(changed, prior(), EARTH) - unusual(usual, prior(), EARTH)


def laws(*names):
    """Make the two colliders of some laws."""

    def change(things):
        for thing, name in zip(things[1:3], names, strict=True):
            thing["contact"]["type"] = name

    return change


def denser(factor):
    """Make the body denser."""

    def change(things):
        things[0]["physics_properties"]["density"] *= factor

    return change


def test_colliders_are_of_the_usual_law_or_all_of_that_of_the_walls():
    usual = extra(laws("separate", "separate"))
    alike, mixed = extra(laws("sticky", "sticky")), extra(laws("sticky", "separate"))
    assert usual == 0.0 < alike < mixed
    assert extra(laws("slip", "slip")) == pytest.approx(mixed)


def test_numbers_of_materials_are_about_the_typical_ones():
    assert extra(denser(1.0)) == 0.0 < extra(denser(1.2)) < extra(denser(1.4)) < 0.01
    assert extra(denser(1 / 1.2)) == pytest.approx(extra(denser(1.2)))
    assert extra(denser(50.0)) == pytest.approx(extra(denser(90.0)))  # it is bounded


def test_rain_is_thinner_than_jets():
    def as_rain(things):
        things[3]["emission"] = {
            "type": "rain",
            "rate": things[3]["emission"]["rate"],
            "velocity": things[3]["emission"]["velocity"],
            "drop_radius": 0.02,
        }

    def thin_rain(things):
        as_rain(things)
        things[3]["emission"]["rate"] /= 13.0

    assert extra(thin_rain) < extra(as_rain)


def starting(velocity, spin):
    """Let the body start so."""

    def change(things):
        state = things[0]["initial_state"]
        state |= {"velocity": velocity, "angular_velocity": spin}

    return change


def test_what_rests_does_not_spin_and_nothing_creeps():
    rests, flies = extra(starting([0.0, 0.0], 0.0)), extra(starting([0.5, 0.0], 0.0))
    assert rests == flies
    assert extra(starting([0.0, 0.0], 2.0)) > extra(starting([0.5, 0.0], 2.0)) > flies
    assert extra(starting([0.5, 0.0], 0.2)) > extra(starting([0.5, 0.0], 2.0))
    assert extra(starting([0.02, 0.0], 0.0)) > rests


def shaped(kind, *, belt):
    """Make the still thing of a shape, and a belt or not."""

    def change(things):
        things[1]["shape"] = {"type": kind, "center": [0.5, 0.2]}
        if belt:
            things[1]["object_type"] = "kinematic_collider"
            things[1]["kinematics"] = {"type": "conveyor", "surface_speed": 1.0}

    return change


def test_a_capsule_that_stays_is_a_belt():
    assert extra(shaped("capsule", belt=False)) > extra(shaped("capsule", belt=True))
    assert extra(shaped("circle", belt=False)) < extra(shaped("circle", belt=True))
    assert extra(shaped("box", belt=False)) < extra(shaped("box", belt=True))
