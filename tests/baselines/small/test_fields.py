"""What a regime tells as numbers: of whom, and nothing that it hides."""

import numpy as np
import pytest

from mpmworlds.baselines.small.fields import fields_of
from mpmworlds.baselines.small.slots import Slots
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.sim.scene.scene import Scene

SEEDS = load_seeds()
TOLD = [name for name, regime in REGIMES.items() if not regime.blind]


def slots_of(scene):
    return Slots(tuple(thing.visualization.color for thing in scene.objects)[:8])


def told(scene, regime):
    return fields_of(REGIMES[regime].tell(scene), slots_of(scene))


def changed(scene, change):
    data = scene.to_data()
    change(data)
    return Scene.from_data(data)


def test_nothing_told_is_nothing():
    assert not fields_of("", Slots(("#F52D2C",))).any()


@pytest.mark.parametrize("regime", TOLD)
@pytest.mark.parametrize("name", sorted(SEEDS)[::12])
def test_each_slot_has_what_is_told_of_its_object(regime, name):
    found = told(SEEDS[name], regime)
    colors = slots_of(SEEDS[name]).colors
    assert found[0].any()
    assert all(found[1 + k].any() for k in range(len(set(colors))))
    assert not found[1 + len(colors) :].any()


def test_what_the_regime_hides_changes_nothing():
    scene = SEEDS[min(SEEDS)]
    body = next(
        k for k, t in enumerate(scene.objects) if t.object_type == "dynamic_body"
    )

    def denser(data):
        data["objects"][body]["physics_properties"]["density"] *= 1.25

    other = changed(scene, denser)
    for regime in TOLD:
        same = np.array_equal(told(scene, regime), told(other, regime))
        assert same == (regime in ("no_materials", "caption")), regime


def test_a_material_in_a_caption_is_of_its_object():
    text = "Gravity pulls down. object_0: deep red box, dynamic body, material {}, low."
    slots = Slots(("#F52D2C", "#A81919"))  # red, deep red
    one, other = (fields_of(text.format(m), slots) for m in ("sand", "snow"))
    assert (one != other).any(axis=1).tolist() == [k == 2 for k in range(len(one))]
