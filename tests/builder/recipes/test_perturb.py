"""A perturbation jitters numbers within its bounds and keeps all structure."""

import copy

import numpy as np
from hypothesis import given

from mpmworlds.builder.recipes.perturb import perturb
from mpmworlds.sim.program.features.motion import FOREVER
from mpmworlds.sim.scene.scene import Scene, SceneError
from tests.builder.recipes.edits import (
    SCENES,
    TABLES,
    ZOO,
    changes,
    edited,
    generators,
    many,
    places,
    scenes,
)

SHIFT, TURN = (TABLES.jitter[kind].shift for kind in ("position", "angle"))
RATIO = TABLES.jitter["length"].factor
ROUNDING = 0.005  # edited numbers keep four digits
SEED = ("simulation", "seed")


def jittered_scene(rng, scene):
    """Plain data before and after a perturbation, and its record."""
    return edited(lambda rng, data: perturb(rng, TABLES, data), rng, scene)


@many
@given(generators, scenes)
def test_perturbing_keeps_structure_and_stays_within_its_bounds(rng, scene):
    before, after, record = jittered_scene(rng, scene)
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


def test_perturbing_reaches_every_number_but_those_of_the_solver():
    """Also of the materials; what is 0, or at the end of its range, stays there."""
    kept = {"blade_count", "skin_cells", "phase_deg"}
    unmoved = set()
    for name in ("zoo 0", "s19_five_materials", "s15_wet_sandcastle", "s16_honey_ramp"):
        start = places({"objects": SCENES[name].to_data()["objects"]})
        numbers = {
            path
            for path, value in start.items()
            if isinstance(value, float) and value not in (0.0, FOREVER)
        }
        changed = set()
        for seed in range(12):
            rng = np.random.default_rng(seed)
            changed |= changes(*jittered_scene(rng, SCENES[name])[:2])
        unmoved |= {path[-1] for path in numbers - changed}
    assert unmoved <= kept


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

    monkeypatch.setattr("mpmworlds.builder.recipes.perturb.TRIES", 0)
    scene = ZOO[1].to_data()
    assert (
        perturb(np.random.default_rng(0), TABLES, copy.deepcopy(scene))["jittered"]
        == []
    )
    monkeypatch.setattr("mpmworlds.builder.recipes.perturb.TRIES", 40)
    monkeypatch.setattr(Scene, "with_object", refuse)
    jittered = [
        perturb(np.random.default_rng(seed), TABLES, copy.deepcopy(scene))["jittered"]
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
    record = perturb(np.random.default_rng(0), TABLES, data)
    assert record["jittered"] == []
    assert changes(before, data) == {SEED}


def test_what_is_drawn_follows_from_the_generator_alone():
    scene = ZOO[0].to_data()
    one, other, third = (copy.deepcopy(scene) for _ in range(3))
    assert perturb(np.random.default_rng(3), TABLES, one) == perturb(
        np.random.default_rng(3), TABLES, other
    )
    perturb(np.random.default_rng(4), TABLES, third)
    assert one == other != third
