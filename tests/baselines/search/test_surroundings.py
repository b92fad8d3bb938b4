"""What things touch, and spins, are told by what comes of it."""

import pytest

from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.trials.lab import Lab
from mpmworlds.baselines.search.trials.moves import Doubt
from mpmworlds.baselines.search.trials.readings import classes_of
from mpmworlds.baselines.search.trials.surroundings import OFTEN_BELTS, Surroundings
from mpmworlds.baselines.search.trials.tried import Known, Tried
from mpmworlds.loaders.prompts import VideoForm
from tests.baselines.search.worlds import checked, prefix_of, world

SMALL = VideoForm(150, 15, 128)


def landing(*things):
    """A ball that is about to land, on something if there is more."""
    data = world("ball", *things, cells=64, form=SMALL).to_data()
    data["environment"]["walls"]["friction"] = 0.5
    ball = data["objects"][0]
    ball["physics_properties"] = prior().typical("elastic")
    ball["shape"] |= {"center": [0.5, 0.22 if not things else 0.36], "radius": 0.09}
    ball["initial_state"] = {"velocity": [0.2, -1.5], "angular_velocity": 0.0}
    return data


def belted(speed=None):
    """One on a capsule, which is a belt if it has a speed."""
    data = landing("still")
    data["objects"][1]["shape"] = {
        "type": "capsule",
        "center": [0.5, 0.2],
        "angle_deg": 0.0,
        "length": 0.5,
        "radius": 0.04,
    }
    data["objects"][1]["contact"] = {
        "type": "separate",
        "friction": 0.8,
        "skin_cells": 0.3,
    }
    if speed is not None:
        data["objects"][1]["object_type"] = "kinematic_collider"
        motion = {"type": "conveyor", "surface_speed": speed}
        data["objects"][1]["kinematics"] = motion
    return data


def looked(truth, start, told=(), *, tries):
    """The search after some tries from a scene."""
    seen = labels_of(prefix_of(checked(truth)))
    doubt = Doubt(dict(told), {}, (), (), walls=True)
    known = Known(doubt, (0.0, -9.8), {}, [1], {})
    with Lab(seen, SMALL, 40, 1e6) as lab:
        tried = Tried(lab, prior(), known)
        tried.run(checked(start).to_data(), "start")
        tries(Surroundings(tried), tried)
        return tried


@pytest.mark.parametrize("speed", [1.1, -0.7])
def test_a_belt_is_told_by_what_it_carries(speed):
    found = looked(belted(speed), belted(), tries=lambda s, _: s.belts(OFTEN_BELTS))
    belt = found.best.data["objects"][1]
    assert belt["kinematics"]["surface_speed"] * speed > 0.0
    assert belt["contact"]["friction"] == prior().contact_of(belt)["friction"]
    assert len(found.trials) == 3


def test_a_thing_whose_type_is_told_is_no_belt():
    told = {1: {"object_type": "static_collider"}}
    found = looked(belted(1.0), belted(), told, tries=lambda s, _: s.belts())
    assert len(found.trials) == 1


@pytest.mark.parametrize("spin", [3.0, -4.0])
def test_the_spin_of_a_ball_is_told_by_how_it_lands(spin):
    truth = landing()
    truth["objects"][0]["initial_state"]["angular_velocity"] = spin
    found = looked(truth, landing(), tries=lambda s, _: s.spins())
    assert found.best.data["objects"][0]["initial_state"]["angular_velocity"] * spin > 0


def test_a_ball_that_rests_is_not_tried_with_a_spin():
    start = landing()
    start["objects"][0]["initial_state"]["velocity"] = [0.0, 0.0]
    assert len(looked(start, start, tries=lambda s, _: s.spins()).trials) == 1


@pytest.mark.parametrize("law", ["sticky", "separate"])
def test_walls_are_tried_with_the_next_best_matter_unless_all_is_explained(law):
    """Wrong matter may make up for walls that were not tried."""
    truth, start = landing(), landing()
    for scene, contact in ((truth, law), (start, "separate")):
        scene["objects"][0]["initial_state"]["velocity"] = [1.5, -1.5]
        scene["environment"]["walls"] |= {"contact": contact, "friction": 0.0}
    others = {"elastic_fem", "snow"}

    def tries(surroundings, tried):
        for name in sorted(others):
            tried.run(tried.of_class(tried.best.data, [0], name), name)
        surroundings.walls()

    found = looked(truth, start, tries=tries)
    slips = {
        classes_of(trial.data)[0]
        for trial in found.trials
        if trial.data["environment"]["walls"]["contact"] == "slip"
    }
    assert slips == {"elastic"} | (others if law == "sticky" else set())
