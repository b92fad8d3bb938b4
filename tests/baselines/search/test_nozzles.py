"""Nozzles are found from what leaves them."""

import pytest

from mpmworlds.baselines.search.prior import prior
from tests.baselines.search.looking import seen, sight_of
from tests.baselines.search.worlds import COLORS, checked, prefix_of, world


@pytest.fixture(scope="module")
def poured():
    return seen("jet", "rain")


def test_a_jet_is_measured(poured):
    nozzle = poured[2][0].nozzles[0]
    assert nozzle.emission["type"] == "jet"
    assert nozzle.shape["center"] == pytest.approx([0.15, 0.8], abs=0.012)
    assert nozzle.emission["velocity"] == pytest.approx([1.5, 0.0], abs=0.15)
    assert nozzle.emission["start"] == pytest.approx(0.06, abs=0.012)


def test_rain_is_measured_by_its_drops(poured):
    nozzle = poured[2][1].nozzles[0]
    assert nozzle.emission["type"] == "rain"
    assert nozzle.shape["center"] == pytest.approx([0.6, 0.85], abs=0.015)
    assert nozzle.emission["velocity"] == pytest.approx([0.0, -1.0], abs=0.12)
    assert nozzle.emission["drop_radius"] == pytest.approx(0.025, rel=0.1)
    assert nozzle.emission["rate"] == pytest.approx(4000.0, rel=0.2)
    assert nozzle.shape["size"][0] == pytest.approx(0.3, rel=0.12)


def test_many_small_drops_are_numbered_by_their_places():
    data = world("rain").to_data()
    rain = data["objects"][0]
    rain["shape"] |= {"center": [0.5, 0.55], "angle_deg": 45.0, "size": [0.5, 0.05]}
    rain["emission"] |= {"rate": 3830.0, "drop_radius": 0.0185, "velocity": [0.8, -0.8]}
    sight = sight_of(checked(data))
    nozzle = sight.things[0].nozzles[0]
    assert nozzle.emission["rate"] == pytest.approx(3830.0, rel=0.12)
    assert nozzle.shape["center"] == pytest.approx([0.5, 0.55], abs=0.012)
    assert nozzle.shape["size"][0] == pytest.approx(0.5, rel=0.06)


def test_one_drop_that_falls_long_tells_gravity():
    data = world("rain", gravity=(-1.5, -5.5)).to_data()
    rain = data["objects"][0]
    rain["emission"] |= {"rate": 1000.0, "drop_radius": 0.042}
    sight = sight_of(checked(data))
    assert sight.gravities[0].value == pytest.approx((-1.5, -5.5), abs=0.4)


def test_one_drop_is_rain_though_something_is_near_it():
    data = world("still", "rain").to_data()
    still, rain = data["objects"]
    rain["shape"] |= {"center": [0.5, 0.8], "size": [0.3, 0.05]}
    rain["emission"] |= {"rate": 1000.0, "drop_radius": 0.045}  # each 0.42 s
    still["shape"] |= {"center": [0.4, 0.655], "angle_deg": 90.0}
    sight = sight_of(checked(data))
    nozzle = sight.things[1].nozzles[0]
    assert nozzle.emission["type"] == "rain"
    assert nozzle.emission["drop_radius"] == pytest.approx(0.045, rel=0.1)


def test_drops_that_pile_up_on_something_tell_their_nozzle():
    data = world("still", "rain").to_data()
    still, rain = data["objects"]
    still["shape"] = {"type": "box", "center": [0.5, 0.2], "size": [0.5, 0.14]}
    rain["shape"] |= {"center": [0.5, 0.62], "size": [0.4, 0.05]}
    rain["emission"] |= {"rate": 2100.0, "drop_radius": 0.035}
    sight = sight_of(checked(data))
    thing = next(t for t in sight.things if t.track.color == COLORS[1])
    nozzle = thing.nozzles[0]
    assert nozzle.emission["type"] == "rain"
    assert nozzle.shape["center"] == pytest.approx([0.5, 0.62], abs=0.025)
    assert nozzle.emission["velocity"] == pytest.approx([0.0, -1.0], abs=0.12)
    assert nozzle.emission["rate"] == pytest.approx(2100.0, rel=0.1)


def test_a_jet_that_meets_something_at_once_is_no_rain():
    """Two frames of it are free, and a fan cuts what falls into pieces."""
    data = world("still", "jet", "fan").to_data()
    still, jet, fan = data["objects"]
    still["shape"] = {
        "type": "polygon",
        "center": [0.827, 0.627],
        "vertices": [[0.0, 0.297], [0.0, 0.178], [-0.18, 0.013], [-0.18, -0.013]]
        + [[0.0, -0.178], [0.0, -0.31], [0.04, -0.31], [0.04, -0.159]]
        + [[-0.13, 0.0], [0.04, 0.159], [0.04, 0.297]],
    }
    jet["shape"] |= {"center": [0.584, 0.709], "size": [0.068, 0.068]}
    jet["shape"]["angle_deg"] = -50.8
    jet["emission"] |= {"rate": 6264.0, "velocity": [1.32, -0.99], "start": 0.0}
    fan["shape"] |= {"center": [0.56, 0.36], "blade_count": 4, "blade_length": 0.2}
    fan["shape"]["thickness"] = 0.04
    fan["kinematics"]["angular_velocity"] = -17.6
    sight = sight_of(checked(data))
    thing = next(t for t in sight.things if t.track.color == COLORS[1])
    emission = thing.nozzles[0].emission
    assert emission["type"] == "jet"
    assert emission["velocity"] == pytest.approx([1.32, -0.99], abs=0.15)


def fallen(**emission):
    """The nozzle that is seen of some rain along the left wall, and the true one."""
    data = world("rain").to_data()
    rain = data["objects"][0]
    rain["shape"] |= {"center": [0.247, 0.873], "size": [0.386, 0.05]}
    rain["physics_properties"] = prior().typical("plastic")
    rain["emission"] |= {"velocity": [0.0, -0.86], "drop_radius": 0.037} | emission
    sight = sight_of(checked(data))
    return sight.things[0].nozzles[0], rain


def test_a_drop_that_falls_along_a_wall_spoils_no_others():
    nozzle, rain = fallen(rate=1300.0)
    assert nozzle.emission["type"] == "rain"
    assert nozzle.shape["center"] == pytest.approx(rain["shape"]["center"], abs=0.03)
    assert nozzle.emission["rate"] == pytest.approx(1300.0, rel=0.1)
    assert nozzle.emission["start"] == 0.0


@pytest.mark.parametrize(
    ("speed", "width", "rate", "start"),
    [(0.4, 0.13, 640.0, 0.0), (1.0, 0.39, 1300.0, 0.3)],
    ids=["slow", "fast"],
)
def test_slow_rain_is_narrow_where_one_drop_is_all_that_is_seen(
    speed, width, rate, start
):
    data = world("rain").to_data()
    rain = data["objects"][0]
    rain["shape"] |= {"center": [0.5, 0.8], "size": [width, 0.05]}
    rain["emission"] |= {"rate": rate, "drop_radius": 0.047}
    rain["emission"] |= {"velocity": [0.0, -speed], "start": start}
    scene = checked(data)
    assert prefix_of(scene)[-1].any()
    nozzle = sight_of(scene).things[0].nozzles[0]
    assert nozzle.shape["size"][0] == pytest.approx(width, rel=0.5)
    assert nozzle.shape["center"] == pytest.approx([0.5, 0.8], abs=0.06)


def cut(blade, turned, spin, rain, **emission):
    """The nozzle that is seen of rain that a blade cuts, and the true one."""
    data = world("fan", "rain").to_data()
    fan, poured = data["objects"]
    fan["shape"] = {"type": "box", "center": blade, "size": [0.33, 0.03]}
    fan["shape"]["angle_deg"] = turned
    fan["kinematics"] = {"type": "rotate", "angular_velocity": spin}
    poured["physics_properties"] = prior().typical("snow")
    poured["shape"] |= {"center": rain, "size": [0.4, 0.05]}
    poured["emission"] |= {"start": 0.0} | emission
    sight = sight_of(checked(data))
    thing = next(t for t in sight.things if t.track.color == COLORS[1])
    return thing.nozzles[0], poured


@pytest.mark.parametrize(
    ("blade", "turned", "spin", "rain", "rate", "radius", "speed"),
    [
        # Its fits once left the domain.
        ([0.46759, 0.71221], 155.181, -15.0, [0.46262, 0.87155], 1843.3, 0.0466, 1.28),
        # One drop is seen whole, the next one never.
        ([0.58172, 0.72886], 174.2, -15.0, [0.48624, 0.84063], 1215.9, 0.0428, 1.34),
        # The first one and the third one are.
        ([0.46736, 0.76384], 14.679, -15.0, [0.37665, 0.88297], 2290.1, 0.0394, 1.25),
    ],
    ids=["outside", "one", "first and third"],
)
def test_rain_that_a_blade_cuts_is_measured_by_the_drops_that_are_left(
    blade, turned, spin, rain, rate, radius, speed
):
    emission = {"rate": rate, "drop_radius": radius, "velocity": [0.0, -speed]}
    nozzle, poured = cut(blade, turned, spin, rain, **emission)
    assert nozzle.emission["type"] == "rain"
    assert nozzle.shape["center"] == pytest.approx(poured["shape"]["center"], abs=0.03)
    assert nozzle.emission["velocity"] == pytest.approx([0.0, -speed], abs=0.2)
    assert nozzle.emission["rate"] == pytest.approx(rate, rel=0.2)
