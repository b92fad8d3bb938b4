"""Predictors by name."""

import pytest

from mpmworlds.baselines.protocol import Failure
from mpmworlds.baselines.registry import PREDICTORS, predictor_named


@pytest.mark.parametrize("name", PREDICTORS)
def test_predictor_bears_the_name_it_is_found_by(name):
    assert predictor_named(name).name == name


def test_unknown_predictor_is_an_error_that_lists_the_known():
    with pytest.raises(ValueError, match=r"'nobody': unknown.*'copy_last'"):
        predictor_named("nobody")


class Mine:
    """A predictor of one's own."""

    name = "mine"

    def __init__(self, n, checkpoint="a.pt"):
        self.n, self.checkpoint = n, checkpoint

    def predict(self, task):
        return []


NO_PREDICTOR = object


def test_a_class_of_one_s_own_is_made_with_its_options():
    mine = predictor_named(f"{__name__}:Mine", {"n": 15})
    assert (mine.n, mine.checkpoint) == (15, "a.pt")


@pytest.mark.parametrize(
    ("name", "options", "told"),
    [
        ("Mine", {"m": 1}, r"its options are \['n', 'checkpoint'\]"),
        ("Yours", {}, "no attribute 'Yours'"),
        ("NO_PREDICTOR", {}, "is no predictor; it needs a name"),
    ],
)
def test_what_cannot_be_made_is_told_why(name, options, told):
    with pytest.raises(ValueError, match=told):
        predictor_named(f"{__name__}:{name}", options)


def test_a_module_that_is_not_there_is_told():
    with pytest.raises(ValueError, match=r"No module named 'nowhere'.*PYTHONPATH"):
        predictor_named("nowhere.at.all:Mine")


def test_options_of_a_built_in_predictor_are_checked():
    assert predictor_named("codec", {"crf": 30}).name == "codec"
    with pytest.raises(ValueError, match="its options are none"):
        predictor_named("black", {"shade": 3})


def test_failure_cannot_be_called_ok():
    with pytest.raises(ValueError, match="must be a word for the failure"):
        Failure("ok", "nothing happened")
