"""Small known scenes are recovered within a few runs."""

import pytest

from mpmworlds.baselines.search.infer import Budget, infer
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.recovery import matches
from mpmworlds.baselines.search.side import Told, read_side
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.sim.scene.objects import MATERIALS
from tests.baselines.search.worlds import checked, prefix_of, world

SMALL = VideoForm(90, 15, 128)
SOLID = {"elastic", "elastic_fem", "viscoelastic", "rigid", "plastic"}
FAMILIES = (SOLID, {"liquid", "viscoplastic"}, {"sand", "wet_sand"}, {"snow"})


def found_of(scene, regime="frames_only", runs=12):
    """The scene that search finds of what a scene draws, in plain data."""
    told = read_side(REGIMES[regime].tell(scene))
    prefix = prefix_of(scene)
    return infer(prefix, 15, SMALL, told, Budget(runs, 5.0), 1).search.best.data


@pytest.mark.slow
@pytest.mark.parametrize("name", MATERIALS)
def test_a_material_is_of_its_family(name):
    """The layout is told, numbers of the material differ from the typical ones."""
    data = world("brick", "still", cells=64, form=SMALL).to_data()
    brick = data["objects"][0]
    typical = prior().typical(name)
    brick["physics_properties"] = typical | {"density": 1.1 * typical["density"]}
    brick["shape"] |= {"center": [0.3, 0.4], "size": [0.2, 0.2], "angle_deg": 0.0}
    brick["initial_state"] = {"velocity": [0.4, -1.5], "angular_velocity": 0.0}
    found = found_of(checked(data), "no_materials")
    got = found["objects"][0]["physics_properties"]["constitutive_model"]
    (family,) = (names for names in FAMILIES if name in names)
    assert got in family


@pytest.mark.slow
def test_a_scene_of_each_object_type_is_recovered():
    scene = world("still", "fan", "ball", "jet", form=SMALL)
    found = found_of(scene, runs=4)
    there = list(matches(scene.to_data(), found))
    assert [match.type for match in there] == [1.0] * 4
    assert all(match.shape in (1.0, None) for match in there)
    assert all(match.place < 0.03 for match in there)


@pytest.mark.slow
def test_a_belt_is_told_from_a_still_thing_by_what_lies_on_it():
    data = world("brick", "still", form=SMALL).to_data()
    brick, belt = data["objects"]
    brick["shape"] |= {"center": [0.3, 0.33], "angle_deg": 0.0}
    brick["initial_state"] = {"velocity": [0.0, 0.0], "angular_velocity": 0.0}
    belt["object_type"] = "kinematic_collider"
    belt["shape"] = {"type": "box", "center": [0.5, 0.22], "size": [0.7, 0.08]}
    belt["kinematics"] = {"type": "conveyor", "surface_speed": 0.8}
    belt["contact"] = {"type": "slip", "friction": 0.8, "skin_cells": 0.3}
    found = found_of(checked(data), runs=24)
    (motion,) = (t["kinematics"] for t in found["objects"] if "kinematics" in t)
    assert motion["type"] == "conveyor"
    assert 0.4 < motion["surface_speed"] < 1.4


@pytest.mark.slow
def test_a_bounce_is_found_to_a_few_percent():
    """Velocity, gravity and stiffness of one body that flies and bounces."""
    data = world("ball", gravity=(0.5, -7.0), form=SMALL).to_data()
    ball = data["objects"][0]
    ball["physics_properties"] = prior().typical("elastic") | {"youngs_modulus": 1.2e5}
    ball["shape"]["center"] = [0.4, 0.3]
    ball["initial_state"]["velocity"] = [0.3, -1.0]
    scene = checked(data)
    told = Told(objects=())
    found = infer(prefix_of(scene), 15, SMALL, told, Budget(34, 5.0), 1)
    (match,) = matches(data, found.search.best.data)
    assert match.material == 1.0
    assert match.speed < 0.06
    guesses = {f"all {name}" for name in MATERIALS}
    assert found.search.best.loss < 0.6 * min(
        trial.loss for trial in found.search.trials if trial.what in guesses
    )
