"""Rules that no single field can see are told with their bound and a remedy."""

import copy
import math

import pytest

from mpmworlds.sim.scene.checks import HUE_STEP, jet_width
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.sim.scene.steps import COURANT, DIFFUSION, fastest_step, spacing
from tests.sim.scenes import (
    BELT,
    BODY,
    EGG,
    ELASTIC,
    FAN,
    GATE,
    HOSE,
    JET,
    MESH,
    OBSTACLE,
    PLASTIC,
    RAIN,
    RIGID,
    ROCKER,
    SAND,
    scene_data,
)


def faults_of(*objects, **sections):
    """What is wrong with a scene of these objects, the four of the module if none."""
    data = scene_data()
    data |= {"objects": list(objects)} if objects else {}
    for section, values in sections.items():
        data[section] = data[section] | values
    try:
        Scene.from_data(data)
    except SceneError as error:
        return error.faults
    return []


def having(thing, **parts):
    """A copy of an object in which parts have other values, mappings merged."""
    thing = copy.deepcopy(thing)
    for key, value in parts.items():
        thing[key] = thing[key] | value if isinstance(value, dict) else value
    return thing


def at(thing, x, y):
    return having(thing, shape={"center": [x, y]})


def test_the_scene_of_this_module_has_no_fault():
    assert faults_of(BODY, OBSTACLE, FAN, JET) == []


@pytest.mark.parametrize(
    ("objects", "sections", "parts"),
    [
        (
            [BODY, having(OBSTACLE, name="object_0")],
            {},
            ["objects[1] 'object_0': name is taken", "must be unique"],
        ),
        (
            [having(BODY, name="wet_sand_1")],
            {},
            ["objects[0] 'wet_sand_1': name gives away 'sand'", "'object_0'"],
        ),
        (
            [having(BODY, shape={"size": [0.03, 0.03]})],
            {},
            [
                "objects[0] 'object_0': shape holds 4 particles, must hold >= 16",
                "raise",
            ],
        ),
        (
            [OBSTACLE, FAN],
            {},
            ["objects hold no particles; add a dynamic_body or an emitter"],
        ),
        (
            [having(JET, emission={"rate": 500.0})],
            {},
            [
                "objects[0] 'object_3': emission.rate = 500, must be <= 492",
                "lower rate",
            ],
        ),
        (
            [having(JET, emission={"rate": 1.0})],
            {},
            ["objects[0] 'object_3': emission makes no particle; raise rate or stop"],
        ),
        (
            [having(HOSE, emission={"period": 0.05})],
            {},
            ["objects[0] 'hose': emission.rate = 300, must be <= 0"],
        ),
        (
            [having(RAIN, emission={"rate": 1200.0})],
            {},
            ["objects[0] 'cloud': emission.rate = 1200, must be <= ", "drops overlap"],
        ),
        (
            [having(RAIN, shape={"size": [0.04, 0.01]})],
            {},
            [
                "objects[0] 'cloud': emission.drop_radius = 0.025, must be <= 0.0",
                "half of the nozzle across the velocity; lower it or raise shape.size",
            ],
        ),
        (
            [having(RAIN, shape={"center": [0.25, 0.895], "size": [0.25, 0.02]})],
            {},
            ["objects[0] 'cloud': shape reaches from 0.1", "must stay within [0.094,"],
        ),
        (
            [],
            {"output": {"resolution": 63}},
            ["resolution = 63, must be even", "use 64"],
        ),
        (
            [],
            {"simulation": {"time_step_dt": 2e-3}},
            ["time_step_dt = 0.002, must be <= 0.00108 for 'object_3'", "lower it"],
        ),
        (
            [BODY, having(JET, visualization={"color": PALETTE["vermilion"]})],
            {},
            [
                "objects[1] 'object_3': color = '#F45F2D' is too near to '#F52D2C' of",
                "objects[0] 'object_0'; take the same, or a hue 25 degrees away",
            ],
        ),
        (
            [at(BODY, 0.1, 0.5)],
            {},
            [
                "objects[0] 'object_0': shape reaches from 0.000 to 0.580 m",
                "must stay within [0.094, 0.906] m; move or shrink it",
            ],
        ),
        (
            [BODY, having(GATE, kinematics={"stop": 0.5})],
            {},
            ["objects[1] 'object_2': shape reaches from 0.200 to 1.400 m on its way"],
        ),
        (
            [BODY, at(FAN, 0.1, 0.5)],
            {},
            ["objects[1] 'object_2': shape reaches from -0.070"],
        ),
        (
            [EGG, having(ROCKER, kinematics={"amplitude": [0.3, 0.0]})],
            {},
            ["objects[1] 'rocker': shape reaches from -0.146 to 0.750 m on its way"],
        ),
        (
            [BODY, at(OBSTACLE, 0.25, 0.55)],
            {},
            [
                "objects[1] 'object_1': shape overlaps objects[0] 'object_0'",
                "at the start; move one of them",
            ],
        ),
        (
            [EGG, having(BELT, contact={"friction": 0.0})],
            {},
            ["contact.friction = 0 on a conveyor, must be > 0", "raise it, or"],
        ),
        (
            [OBSTACLE | {"object_type": "dynamic_body", "physics_properties": RIGID}],
            {},
            ["object_1': shape has its center of mass at [0.0000, -0.0267] m", "shift"],
        ),
    ],
)
def test_fault_names_object_value_bound_and_remedy(objects, sections, parts):
    faults = faults_of(*objects, **sections)
    assert len(faults) == 1
    assert all(part in faults[0] for part in parts)


@pytest.mark.parametrize("material", [MESH, RIGID])
def test_what_is_one_piece_cannot_leave_a_nozzle(material):
    (fault,) = faults_of(BODY, JET | {"physics_properties": material})
    assert "physics_properties.constitutive_model" in fault
    assert "must be one of" in fault


def test_too_many_particles_are_counted_over_bodies_and_jets():
    jets = [
        having(JET, name=f"jet_{i}", emission={"stop": 100.0}, shape={"center": [x, y]})
        for i, (x, y) in enumerate((x, y) for x in (0.2, 0.5, 0.8) for y in (0.5, 0.8))
    ]
    assert faults_of(*jets[:5]) == []
    (fault,) = faults_of(*jets)
    assert "objects hold 240000 particles, must be <= 200000; lower" in fault


def test_colliders_at_rest_may_overlap_and_touch_the_edge_of_the_domain():
    other = having(at(OBSTACLE, 0.35, 0.25), name="object_3")
    assert faults_of(BODY, OBSTACLE, other) == []
    assert faults_of(BODY, at(OBSTACLE, 0.15, 0.1)) == []


def test_a_mover_never_passes_through_a_collider_that_stays():
    (fault,) = faults_of(BODY, OBSTACLE, at(FAN, 0.35, 0.25))
    assert "objects[2] 'object_2': passes through objects[1]" in fault
    assert faults_of(BODY, OBSTACLE, at(FAN, 0.7, 0.25)) == []
    late = having(GATE, kinematics={"velocity": [-1.0, 0.0], "start": 1, "stop": 1.4})
    assert any("passes through" in fault for fault in faults_of(BODY, OBSTACLE, late))


@pytest.mark.parametrize("model", [ELASTIC, PLASTIC])
def test_blades_are_too_slow_to_tear_a_body(model):
    body = having(BODY, physics_properties=model)
    fast = having(FAN, kinematics={"angular_velocity": 60.0})
    (fault,) = [f for f in faults_of(body, fast) if "tears" in f]
    assert "must be <= 5, or it tears objects[0]" in fault
    for whole in (MESH, SAND):
        body = having(BODY, physics_properties=whole)
        assert not any("tears" in fault for fault in faults_of(body, fast))


def test_equal_colours_and_greys_are_never_too_near():
    for color in (PALETTE["red"], PALETTE["white"]):
        assert faults_of(BODY, having(JET, visualization={"color": color})) == []


def test_hues_are_compared_around_the_circle():
    pink = having(JET, visualization={"color": PALETTE["crimson"]})
    (fault,) = faults_of(BODY, pink)
    assert f"a hue {HUE_STEP:.0f} degrees away" in fault


@pytest.mark.parametrize(
    "faster",
    [
        having(BODY, initial_state={"velocity": [3.0, 4.0]}),
        having(BODY, physics_properties={"youngs_modulus": 3e5}),
        having(BODY, physics_properties={"density": 500.0}),
        having(BODY, initial_state={"angular_velocity": 40.0}),
        having(BODY, physics_properties={"damping": 300.0}),
    ],
)
def test_whatever_is_faster_lowers_the_stable_time_step(faster):
    usual, fast = (Scene.from_data(scene_data(body)) for body in (BODY, faster))
    assert fastest_step(fast)[0] < fastest_step(usual)[0]


@pytest.mark.parametrize(
    "collider",
    [
        having(FAN, kinematics={"angular_velocity": -60.0}),
        having(GATE, kinematics={"velocity": [0.0, 7.0], "stop": 0.06}),
        having(ROCKER, kinematics={"frequency": 20.0}),
        having(BELT, kinematics={"surface_speed": -8.0}),
    ],
)
def test_a_fast_collider_lowers_the_stable_time_step(collider):
    egg = having(EGG, physics_properties=SAND)  # which does not tear
    alone, moved = (Scene.from_data(scene_data(*o)) for o in ([egg], [egg, collider]))
    (bound, _), (lower, _) = fastest_step(alone), fastest_step(moved)
    assert lower < 0.9 * bound


def test_at_the_stable_time_step_wave_and_fall_cross_the_courant_fraction_of_a_cell():
    scene = Scene.from_data(scene_data(BODY))
    step, name = fastest_step(scene)
    lam_2mu = 2e5 * 0.7 / (1.3 * 0.4)
    speed = math.sqrt(lam_2mu / 1000.0) + math.sqrt(2 * 9.8)
    assert name == "object_0"
    assert step * speed * 32 == pytest.approx(COURANT)


@pytest.mark.parametrize(
    "viscous",
    [
        having(JET, physics_properties={"viscosity": 250.0}),
        having(BODY, physics_properties={"damping": 250.0}),
    ],
)
def test_at_the_stable_time_step_viscosity_spreads_over_its_part_of_a_cell(viscous):
    others = [thing for thing in (BODY, JET) if thing["name"] != viscous["name"]]
    step, name = fastest_step(Scene.from_data(scene_data(viscous, *others)))
    assert name == viscous["name"]
    assert step * 0.25 * 32**2 == pytest.approx(DIFFUSION)


def test_spacing_is_that_of_a_square_lattice():
    scene = Scene.from_data(scene_data())
    assert 4 * spacing(scene) ** 2 == pytest.approx((1 / 32) ** 2)


@pytest.mark.parametrize(
    ("velocity", "width"), [([0.0, -2.0], 0.08), ([3.0, 0.0], 0.04)]
)
def test_a_jet_is_as_wide_as_its_nozzle_across_the_velocity(velocity, width):
    jet = having(JET, emission={"rate": 10.0, "velocity": velocity})
    scene = Scene.from_data(scene_data(jet))
    assert jet_width(scene.objects[0]) == pytest.approx(width)


@pytest.mark.parametrize(
    ("objects", "sections", "told"),
    [
        ([BODY], {"gravity": (0.0, -1e9)}, "environment.gravity is 1e+09 m/s^2, must"),
        (
            [having(BODY, initial_state={"velocity": [1e5, 0.0]})],
            {},
            "objects[0] 'object_0': moves at up to 100000 m/s, must be <= 100",
        ),
    ],
)
def test_nothing_is_so_fast_that_numbers_overflow(objects, sections, told):
    with pytest.raises(SceneError) as error:
        Scene.from_data(scene_data(*objects, **sections))
    assert told in str(error.value)


def test_a_tiny_time_step_does_not_make_a_huge_gravity_valid():
    steps = scene_data()["simulation"] | {"time_step_dt": 1e-105}
    air = {"gravity": [0.0, -1e200]}
    with pytest.raises(SceneError, match=r"gravity is 1e\+200 m/s\^2, must be <= 1000"):
        Scene.from_data(scene_data() | {"simulation": steps, "environment": air})
