"""Programs with their numbers in a field draw what they draw without."""

import numpy as np
import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.lifted import lifted
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scene import Scene

FRAMES = 12
# Between them: all laws, walls, kinds of motion and of emission.
SEEDS = ["s01", "s05", "s08", "s13", "s17", "s19", "s20", "s24", "s26", "s34"]


def seed(name):
    """The plain data of a seed, coarse and small."""
    (full,) = [n for n in load_seeds() if n.startswith(name)]
    data = load_seeds()[full].to_data()
    data["output"]["resolution"] = 128
    return data


@pytest.fixture(scope="module")
def warm():
    with WarmStart() as start:
        yield start


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDS)
def test_frames_are_equal_but_for_rounding(name, warm):
    text = link(Scene.from_data(seed(name)))
    plain, free = (
        warm.run(program, FRAMES, 120.0, pictures=True)
        for program in (text, lifted(text).text)
    )
    assert (plain.status, free.status) == ("ok", "ok"), free.message
    differ = (np.asarray(plain.frames) != np.asarray(free.frames)).any(axis=3)
    assert differ.mean() < 1e-3


def softer(data, factor):
    for thing in data["objects"]:
        properties = thing.get("physics_properties", {})
        if "youngs_modulus" in properties:
            properties["youngs_modulus"] *= factor
    data["simulation"]["time_step_dt"] *= 0.5
    data["simulation"]["substeps_per_frame"] *= 2
    return data


def test_kernels_are_equal_if_numbers_alone_differ():
    one, other = (seed("s08") for _ in range(2))
    softer(other, 0.93)
    other["environment"]["gravity"] = [0.3, -9.1]
    other["objects"][0]["initial_state"]["velocity"] = [0.11, 0.22]
    texts = [lifted(link(Scene.from_data(data))) for data in (one, other)]
    assert texts[0].kernels == texts[1].kernels
    assert texts[0].text != texts[1].text


def test_kernels_differ_where_scenes_are_of_another_kind():
    one, other = (seed("s08") for _ in range(2))
    other["environment"]["walls"]["contact"] = "sticky"
    assert one["environment"]["walls"]["contact"] != "sticky"
    texts = [lifted(link(Scene.from_data(data))) for data in (one, other)]
    assert texts[0].kernels != texts[1].kernels
