"""What `import mpmworlds` offers."""

import subprocess
import sys

import pytest

import mpmworlds
from mpmworlds.loaders.load import load
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene


@pytest.mark.parametrize("thing", [Scene, link, load, run])
def test_public_name_is_the_one_of_its_home(thing):
    assert getattr(mpmworlds, thing.__name__) is thing


def test_metrics_score_through_the_public_name():
    assert callable(mpmworlds.metrics.score)
    assert mpmworlds.metrics.__name__ == "mpmworlds.metrics"


def test_every_public_name_resolves_and_is_listed_once():
    for name in mpmworlds.__all__:
        assert getattr(mpmworlds, name) is not None
        assert dir(mpmworlds).count(name) == 1


def test_public_names_resolve_in_a_fresh_interpreter():
    names = "Scene, link, load, metrics, run"
    statement = f"from mpmworlds import {names}; print(run.__module__)"
    done = subprocess.run(
        [sys.executable, "-c", statement], capture_output=True, text=True, check=True
    )
    assert done.stdout == "mpmworlds.sim.run.run\n"


def test_unknown_name_is_an_attribute_error_that_names_it():
    with pytest.raises(AttributeError, match="'mpmworlds' has no attribute 'simulate'"):
        _ = mpmworlds.simulate
