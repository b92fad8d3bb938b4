"""A perturbation jitters numbers within its bounds and keeps all structure."""

import copy

import numpy as np
from hypothesis import given

from mpmworlds.builder.perturb import RATIO, SHIFT, TURN, perturb
from mpmworlds.sim.scene.scene import Scene, SceneError
from tests.builder.edits import (
    SCENES,
    ZOO,
    changes,
    edited,
    generators,
    many,
    places,
    scenes,
)

ROUNDING = 0.005  # edited numbers keep four digits
SEED = ("simulation", "seed")


@many
@given(generators, scenes)
def test_perturbing_keeps_structure_and_stays_within_its_bounds(rng, scene):
    before, after, record = edited(perturb, rng, scene)
    assert record.keys() == {"operator", "jittered"}
    assert record["operator"] == "perturb"
    one, other = places(before), places(after)
    assert one.keys() == other.keys()
    changed = changes(before, after)
    assert SEED in changed
    for path in changed - {SEED}:
        a, b = one[path], other[path]
        assert path[0] == "objects"
        assert isinstance(a, float), path
        if "center" in path:
            assert abs(b - a) <= SHIFT + 1e-4
        elif path[-1] == "angle_deg":
            assert abs(b - a) <= TURN + ROUNDING * max(abs(b), 1.0)
        else:
            low, high = sorted((a / RATIO, a * RATIO))
            slack = ROUNDING * abs(a) + 1e-4
            assert low - slack <= b <= high + slack, path
    moved = {before["objects"][path[1]]["name"] for path in changed - {SEED}}
    assert moved == set(record["jittered"])
    assert len({path[1] for path in changed if "center" in path}) == len(moved)
    Scene.from_data(after)


def test_perturbing_reaches_every_length_and_speed_in_some_draw():
    kept = {"phase_deg", "start", "stop", "rate"}
    start = places(ZOO[0].to_data())
    numbers = {
        path
        for path, value in start.items()
        if {"shape", "kinematics", "emission"} & set(path)
        and not kept & set(path)
        and isinstance(value, float)
    }
    changed = set()
    for seed in range(12):
        rng = np.random.default_rng(seed)
        changed |= changes(*edited(perturb, rng, ZOO[0])[:2])
    assert numbers - changed == set()


def test_perturbing_reaches_every_modulus_and_density():
    changed = set()
    for name in ("s19_five_materials", "s15_wet_sandcastle", "s16_honey_ramp"):
        one, other, _ = edited(perturb, np.random.default_rng(1), SCENES[name])
        changed |= {path[-1] for path in changes(one, other)}
    keys = {"density", "youngs_modulus", "bulk_modulus", "viscosity", "cohesion"}
    assert keys <= changed
    kept = {"constitutive_model", "poissons_ratio", "friction_angle_deg", "color"}
    assert not kept & changed


def test_an_object_with_little_room_changes_less(monkeypatch):
    within = Scene.with_object

    def refuse(scene, number, data):
        there = scene.objects[number].shape.center
        if (
            max(abs(a - b) for a, b in zip(data["shape"]["center"], there, strict=True))
            > SHIFT / 4
        ):
            raise SceneError("scene", ["no room"])
        return within(scene, number, data)

    monkeypatch.setattr("mpmworlds.builder.perturb.TRIES", 0)
    scene = ZOO[1].to_data()
    assert perturb(np.random.default_rng(0), copy.deepcopy(scene))["jittered"] == []
    monkeypatch.setattr("mpmworlds.builder.perturb.TRIES", 40)
    monkeypatch.setattr(Scene, "with_object", refuse)
    jittered = [
        perturb(np.random.default_rng(seed), copy.deepcopy(scene))["jittered"]
        for seed in range(5)
    ]
    names = [thing["name"] for thing in scene["objects"]]
    assert jittered == [names] * 5


def test_objects_without_room_stay_as_they_are(monkeypatch):
    def refuse(scene, number, data):
        raise SceneError("scene", ["no room"])

    monkeypatch.setattr(Scene, "with_object", refuse)
    data = ZOO[1].to_data()
    before = copy.deepcopy(data)
    record = perturb(np.random.default_rng(0), data)
    assert record["jittered"] == []
    assert changes(before, data) == {SEED}


def test_what_is_drawn_follows_from_the_generator_alone():
    scene = ZOO[0].to_data()
    one, other, third = (copy.deepcopy(scene) for _ in range(3))
    assert perturb(np.random.default_rng(3), one) == perturb(
        np.random.default_rng(3), other
    )
    perturb(np.random.default_rng(4), third)
    assert one == other != third
