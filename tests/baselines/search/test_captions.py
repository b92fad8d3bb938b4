"""What a caption says is kept, though the frames do not show it well."""

from dataclasses import replace

import pytest

from mpmworlds.baselines.search.assembly import scene_data
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.repair import written
from mpmworlds.baselines.search.side import read_side
from mpmworlds.loaders.regimes import caption
from mpmworlds.sim.scene.objects import SHAPES
from mpmworlds.sim.scene.scene import Scene
from tests.baselines.search.looking import sight_of
from tests.baselines.search.worlds import (
    COLORS,
    FORM,
    checked,
    world,
)


def guessed(scene, told):
    """The scene that its prefix and a caption tell."""
    sight = sight_of(scene, told)
    gravity = sight.gravities[0].value
    return Scene.from_yaml(written(scene_data(sight, told, FORM, prior(), gravity)))


def test_a_shape_is_of_the_kind_that_is_said_though_something_cuts_it():
    data = world("still", "wall", "fan", "ball").to_data()
    fan, ball = (thing["shape"] for thing in data["objects"][2:])
    data["objects"][0]["shape"] = {
        "type": "box",
        "center": [0.7276, 0.8],
        "angle_deg": -28.0,
        "size": [0.44, 0.03],
    }
    data["objects"][1]["shape"] = {
        "type": "box",
        "center": [0.7381, 0.75],
        "angle_deg": 8.0,
        "size": [0.43, 0.03],
    }
    fan |= {"center": [0.3, 0.3], "blade_count": 2, "thickness": 0.035}
    ball["center"] = [0.5, 0.3]
    truth = checked(data)
    found = guessed(truth, read_side(caption(truth)))
    for thing, known in zip(found.objects, truth.objects, strict=True):
        assert thing.shape.type == known.shape.type
        assert thing.shape.center == pytest.approx(known.shape.center, abs=0.02)
    sizes = [sorted(thing.shape.size) for thing in found.objects[:2]]
    assert sizes[0] == pytest.approx([0.03, 0.44], abs=0.02)
    assert sizes[1] == pytest.approx([0.03, 0.43], abs=0.02)
    assert found.objects[2].shape.blade_count == 2


@pytest.mark.parametrize("kind", sorted(SHAPES))
def test_a_thing_that_is_said_to_be_there_and_not_seen_has_a_shape(kind):
    scene = world("ball")
    told = read_side(caption(scene))
    hidden = {
        "name": "object_1",
        "object_type": "static_collider",
        "shape": {"type": kind},
        "visualization": {"color": COLORS[1]},
    }
    known = replace(
        told,
        objects=(*told.objects, hidden),
        near={**told.near, "object_1": (0.7, 0.2)},
    )
    found = guessed(scene, known).objects[1]
    assert found.shape.type == kind
    assert found.shape.center == (0.7, 0.2)
