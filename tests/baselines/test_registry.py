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


def test_failure_cannot_be_called_ok():
    with pytest.raises(ValueError, match="must be a word for the failure"):
        Failure("ok", "nothing happened")
