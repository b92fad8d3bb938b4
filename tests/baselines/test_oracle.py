"""The oracle: the row's own program, run again."""

import numpy as np
import pytest

from mpmworlds.baselines.scoring import score_example
from mpmworlds.baselines.simple.oracle import OracleProgram
from mpmworlds.loaders.load import Example
from mpmworlds.metrics.reduction import reduce_clip, split_clip

# A stand-in for a simulation: a square that moves right, 90 frames of 512 px at 30 / s.
PROGRAM = """
import numpy as np


def frames():
    for t in range(90):
        frame = np.zeros((512, 512, 3), np.uint8)
        frame[200:300, 2 * t : 2 * t + 100] = (200, 40, 40)
        yield frame
"""


@pytest.fixture
def example():
    frames = {}
    exec(PROGRAM, frames)
    clip = reduce_clip(np.stack(list(frames["frames"]())), 30)
    prefix, continuation = split_clip(clip, 15)
    row = {
        "family_id": "p0001",
        "materials": ["elastic"],
        "object_types": ["dynamic_body"],
        "num_objects": 1,
        "motion": 0.25,
        "ceiling": None,
        "program": PROGRAM,
        "num_frames": 90,
        "framerate": 30,
        "resolution": 512,
    }
    return Example("p0001", prefix, continuation, 15, row)


def test_program_of_the_row_scores_perfectly(example):
    (result,) = score_example(example, OracleProgram()).results
    assert result.reason == ""
    for scores in (result.prefix, result.continuation):
        assert scores["mask_iou"] == 1
        assert scores["mse"] == scores["color_tv"] == scores["semd"] == 0


def test_other_program_does_not_score_perfectly(example):
    example.row["program"] = PROGRAM.replace("2 * t", "3 * t")
    (result,) = score_example(example, OracleProgram()).results
    assert result.continuation["mask_iou"] < 1


def test_program_that_stops_early_is_a_failure(example):
    example.row["program"] = PROGRAM.replace("range(90)", "range(80)")
    (result,) = score_example(example, OracleProgram()).results
    assert result.outcome == "wrong_shape"


def test_program_that_raises_is_a_failure_with_its_reason(example):
    example.row["program"] = PROGRAM + "\nraise RuntimeError('no such luck')\n"
    (result,) = score_example(example, OracleProgram()).results
    assert result.outcome == "exception"
    assert "no such luck" in result.reason
