"""What leaves a nozzle is as many, as dense and where an emission says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter

from mpmworlds.sim.program.features.emissions.hose import Hose
from mpmworlds.sim.program.features.emissions.rain import Rain
from mpmworlds.sim.scene.objects import EMISSIONS, AnyEmission
from mpmworlds.sim.scene.scale import rescale
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import spacing
from tests.sim.scenes import RAIN as RAINING
from tests.sim.scenes import scene_data

SPACING = 1 / 256
JET = {"rate": 1500.0, "velocity": [1.2, -0.9], "start": 0.5, "stop": 1.4}
HOSE = JET | {"type": "hose", "swing_deg": 40.0, "period": 0.6}
RAIN = JET | {"type": "rain", "rate": 900.0, "drop_radius": 0.012}
GIVEN = {"jet": JET, "hose": HOSE, "rain": RAIN}
WIDTH = 0.1
emissions = pytest.mark.parametrize("data", GIVEN.values(), ids=GIVEN)


def emission_of(data):
    return TypeAdapter(AnyEmission).validate_python(data)


def births(emission, width=WIDTH, spacing=SPACING):
    return emission.births(width, spacing)


def densest(emission, width=WIDTH, spacing=SPACING):
    """The same emission at its largest rate."""
    most = emission.most(width, spacing)
    return emission.model_copy(update={"rate": most})


def in_flight(emission, width=WIDTH):
    """Places of particles when the emission stops, had they flown straight on."""
    time, place, velocity = births(emission, width)
    return place + (emission.stop - time)[:, None] * velocity


def distances(points):
    """Distance of each point to the nearest other one."""
    far = np.linalg.norm(points[:, None] - points, axis=2)
    return (far + np.diag(np.full(len(far), np.inf))).min(1)


def test_every_emission_of_the_schema_is_tested():
    assert GIVEN.keys() == EMISSIONS.keys()


def test_an_emission_without_a_type_is_a_jet():
    assert emission_of(JET) == emission_of(JET | {"type": "jet"})


@settings(max_examples=100, deadline=None)
@given(
    data=st.sampled_from(list(GIVEN.values())),
    rate=st.floats(20.0, 20_000.0),
    stop=st.floats(0.6, 1.6),
    spacing=st.floats(0.003, 0.03),
)
def test_particles_are_as_many_as_the_schema_counts(data, rate, stop, spacing):
    emission = emission_of(data | {"rate": rate, "stop": stop})
    time, place, velocity = births(emission, spacing=spacing)
    assert time.shape == (emission.count(spacing),)
    assert place.shape == velocity.shape == (len(time), 2)
    drop = emission.drop(spacing) if emission.type == "rain" else 1
    assert abs(len(time) - rate * (stop - 0.5)) <= 0.5 * drop + 1e-6


@emissions
def test_particles_are_born_between_start_and_stop_in_order(data):
    time, *_ = births(emission_of(data))
    assert 0.5 < time[0] <= time[-1] < 1.4
    assert (np.diff(time) >= 0).all()


@emissions
def test_particles_are_born_evenly_in_time_and_on_both_sides(data):
    time, place, _ = births(emission_of(data))
    count, _ = np.histogram(time, 9, (0.5, 1.4))
    drop = emission_of(data).drop(SPACING) if data is RAIN else 1
    assert np.ptp(count) <= 2 * drop
    across = place @ [0.6, 0.8]
    assert abs(across.mean()) < 0.02 * WIDTH


@emissions
def test_particles_are_born_within_width_and_depth_of_the_nozzle(data):
    emission = emission_of(data)
    _, place, _ = births(emission)
    along, across = place @ [0.8, -0.6], place @ [0.6, 0.8]
    assert 0.9 * WIDTH < np.ptp(across) <= WIDTH
    assert 0.9 * emission.depth(WIDTH) <= np.ptp(along) + 1e-9
    assert abs(along).max() <= 0.5 * emission.depth(WIDTH) + 1e-9


@emissions
def test_births_have_the_speed_of_the_emission(data):
    *_, velocity = births(emission_of(data))
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), 1.5)


def test_a_hose_swings_by_its_amplitude_about_its_velocity_and_first_to_the_left():
    time, _, velocity = births(emission_of(HOSE))
    forward, left = velocity @ [0.8, -0.6], velocity @ [0.6, 0.8]
    angle = np.degrees(np.arctan2(left, forward))
    assert angle.max() == pytest.approx(40, abs=0.01)
    assert angle.min() == pytest.approx(-40, abs=0.01)
    np.testing.assert_allclose(angle, 40 * np.sin(2 * np.pi * (time - 0.5) / 0.6))


def test_a_hose_that_does_not_swing_is_a_jet():
    found = births(emission_of(HOSE | {"swing_deg": 0.0}))
    for one, other in zip(found, births(emission_of(JET)), strict=True):
        np.testing.assert_allclose(one, other)


def test_a_hose_and_its_opposite_are_mirror_images():
    straight = HOSE | {"velocity": [1.0, 0.0]}
    places = in_flight(emission_of(straight))
    other = in_flight(emission_of(straight | {"swing_deg": -40.0}))
    assert places[:, 1].mean() == pytest.approx(-other[:, 1].mean(), abs=0.005)
    assert abs(places[:, 1].mean()) > 0.02


@pytest.mark.parametrize("data", [JET, HOSE, HOSE | {"period": 0.3}])
def test_a_jet_at_its_largest_rate_is_nowhere_denser_than_its_material(data):
    data = data | {"stop": 0.9}
    emission, radius = densest(emission_of(data)), 6 * SPACING
    points = in_flight(emission)
    far = np.linalg.norm(points[:, None] - points, axis=2)
    most = np.pi * radius**2 / SPACING**2
    inside = (far < radius).sum(1)
    assert inside.max() < 1.12 * most  # a lattice has a few more in some discs
    assert inside.max() > (0.95 if emission.type == "jet" else 0.5) * most


@settings(max_examples=50, deadline=None)
@given(
    radius=st.floats(0.005, 0.04),
    drops=st.floats(1.0, 40.0),
    speed=st.floats(0.2, 6.0),
)
def test_at_the_largest_rate_drops_touch_and_do_not_overlap(radius, drops, speed):
    width = 2 * radius * drops
    rainy = emission_of(
        RAIN | {"velocity": [0.0, -speed], "drop_radius": radius, "start": 0.0}
    )
    most = rainy.most(width, SPACING)
    size = rainy.drop(SPACING)
    rainy = rainy.model_copy(update={"rate": most, "stop": 400 * size / most})
    places = in_flight(rainy, width).reshape(-1, size, 2)
    assert distances(places.mean(1)).min() == pytest.approx(2 * radius, rel=1e-6)


@pytest.mark.parametrize("spacings", [0.6, 1.0, 1.7, 3.0, 9.0])
def test_a_drop_is_a_disc_as_dense_as_its_material(spacings):
    radius = spacings * SPACING
    rainy = Rain(
        type="rain", rate=1e5, velocity=(0.0, -5.0), stop=0.1, drop_radius=radius
    )
    time, place, _ = births(rainy)
    size = rainy.drop(SPACING)
    assert size == max(round(np.pi * spacings**2), 1)
    assert (time[:size] == time[0]).all()
    assert size == len(time) or time[size] > time[0]
    if size > 1:
        drop = place[:size]
        assert distances(drop).min() > 0.85 * SPACING
        assert distances(drop).max() < 1.25 * SPACING
        assert np.linalg.norm(drop - drop.mean(0), axis=1).max() < 1.1 * radius


@pytest.mark.parametrize("cells", [32, 64, 128])
def test_rain_falls_in_as_many_drops_at_any_resolution(cells):
    scene = Scene.from_data(scene_data(RAINING))
    other = rescale(scene, cells, 64)
    drops = []
    for s in (scene, other):
        emission, space = s.objects[0].emission, spacing(s)
        drops.append(emission.count(space) / emission.drop(space))
    assert drops[1] == pytest.approx(drops[0], rel=0.1)


def test_small_drops_are_no_denser_than_a_jet():
    small = Rain(type="rain", rate=1.0, velocity=(0.0, -1.0), stop=9, drop_radius=0.002)
    assert small.drop(1 / 64) == 1
    assert small.most(WIDTH, 1 / 64) == pytest.approx(WIDTH * 64**2)


def test_a_hose_that_turns_faster_than_it_flows_emits_nothing():
    hasty = Hose(
        type="hose", rate=1.0, velocity=(0.0, 0.1), stop=9, swing_deg=90.0, period=0.02
    )
    assert hasty.most(WIDTH, SPACING) == 0
    faults = list(hasty.faults(WIDTH, SPACING))
    assert len(faults) == 1
    assert "emission.rate = 1, must be <= 0" in faults[0]
