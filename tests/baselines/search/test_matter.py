"""A body is as large as its class is drawn, so that what is drawn is what was seen."""

import pytest

from mpmworlds.baselines.search.matter import of_matter
from mpmworlds.baselines.search.perception.pixels import GROWN, Pixels, covered
from mpmworlds.baselines.search.prior import prior
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from tests.baselines.search.worlds import checked, world


def brick(name, told):
    data = world("brick").to_data()
    thing = data["objects"][0]
    thing["physics_properties"] = prior().typical("liquid")
    data["objects"][0] = of_matter(thing, prior().typical(name), told)
    return data


@pytest.mark.parametrize("name", ["elastic_fem", "rigid", "sand"])
def test_what_is_drawn_has_the_area_that_was_seen(name):
    fitted = world("brick").to_data()["objects"][0]["shape"]
    seen = covered(fitted, Pixels.of(256, 512), GROWN).sum()
    program = link(checked(brick(name, {})))
    frame = reduce_clip(run(program, 1, trusted=True).expect(), 30)[0]
    assert frame.any(axis=2).sum() == pytest.approx(seen, rel=0.02)


def test_a_shape_that_is_told_stays():
    shape = world("brick").to_data()["objects"][0]["shape"]
    assert brick("elastic_fem", {"shape": shape})["objects"][0]["shape"] == shape
    changed = brick("elastic_fem", {"shape": {"type": "box"}})["objects"][0]["shape"]
    assert changed["size"][0] < shape["size"][0]
    assert changed["center"] == shape["center"]
