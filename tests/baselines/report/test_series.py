"""The numbers behind the figures."""

import pytest

from mpmworlds.baselines.report.board import Split, boards, read_systems
from mpmworlds.baselines.report.numbers import entries
from mpmworlds.baselines.report.series import (
    AVERAGE,
    COLLAPSED,
    CURVED,
    by_family,
    lines,
    normalised,
    sensitivity,
)
from mpmworlds.metrics import METRICS, SCORED
from mpmworlds.metrics.reduction import PREFIX_SECONDS
from tests.baselines.made_results import result, write


@pytest.fixture
def board(folders):
    (board,) = boards(read_systems(map(str, folders)))
    return board


def line(board, label, metric):
    (found,) = [
        line
        for line in lines(board)
        if (line.system.label, line.metric) == (label, metric)
    ]
    return found


def test_time_starts_after_the_prefix_and_ends_with_the_video(board):
    whole = line(board, "copy_last, frames_only", "mask_iou")
    assert (whole.seconds[0], whole.seconds[-1]) == (38 / 15, 149 / 15)
    later = line(board, "copy_last, frames_only", "wmae")
    assert (later.seconds[0], later.seconds[-1]) == (39 / 15, 149 / 15)


@pytest.mark.parametrize("framerate", [5, 10])
def test_time_is_at_the_frame_rate_of_the_release(folders, framerate):
    samples = [f"p{k:04d}" for k in range(1, 5)]
    splits = {("tiny", "test"): Split(samples, framerate)}
    (board,) = boards(read_systems(map(str, folders)), splits)
    found = line(board, "copy_last, frames_only", "mse")
    # The first frame that is predicted is the first one after the prefix.
    first = found.seconds[0]
    assert first - 1 / framerate <= PREFIX_SECONDS < first
    assert found.seconds[-1] == pytest.approx(first + 111 / framerate)


def test_of_two_metrics_with_one_curve_the_amount_is_shown():
    assert set(SCORED) - set(CURVED) == {"anomaly"}


def test_curve_is_the_mean_of_the_valid_samples(board):
    told = line(board, "vlm_7b, full_config", "mse")
    assert told.n == 3
    # Curves grow evenly to the scores .25, .75 and 0.
    assert told.mean[-1] == pytest.approx(1 / 3)
    assert told.mean[55] == pytest.approx(1 / 6)
    assert told.sem[-1] == pytest.approx(0.220479, abs=1e-6)


def test_collapsed_share_counts_samples_above_half(board):
    told = line(board, "vlm_7b, full_config", COLLAPSED)
    # One of three reaches .75: it passes .5 after two thirds of the time.
    assert told.mean[73] == 0.0
    assert told.mean[75] == told.mean[-1] == pytest.approx(1 / 3)


def test_curves_of_different_lengths_are_an_error(tmp_path):
    short = result("p0002", 0.5, curves={name: [0.5] for name in METRICS})
    folder = write(tmp_path / "a", [[result("p0001", 0.5)], [short]])
    (board,) = boards(read_systems([str(folder)]))
    with pytest.raises(ValueError, match="curves of mask_iou have 1 to 112 values"):
        lines(board)


def test_family_means_are_over_the_valid_samples_with_it(board):
    points = {
        (point.system.label, point.family): point.value
        for point in by_family(board)
        if point.metric == "mse"
    }
    told = "vlm_7b, full_config"
    assert points[told, "liquid"].mean == pytest.approx((0.25 + 0.75) / 2)
    assert (points[told, "sand"].mean, points[told, "sand"].n) == (0.0, 1)
    untold = points["vlm_7b, no_materials", "sand"]
    assert (untold.mean, untold.n) == ((0.75 + 0.5) / 2, 2)


def test_sensitivity_is_the_change_on_samples_valid_in_both(board):
    points = {(p.metric, p.family): p.value for p in sensitivity(board)}
    # Goodness .75 -> .5 and .25 -> .5 with liquid, 1 -> .5 with sand.
    for metric in (*METRICS, AVERAGE):
        assert points[metric, "liquid"].mean == pytest.approx(0.0)
        assert points[metric, "sand"].mean == pytest.approx(-0.5)
        assert points[metric, "liquid"].n == 2


def test_normalised_score_is_min_max_over_the_rows(board):
    # Means of goodness .5, .6667 and .4375 in every metric.
    assert normalised(board, entries(board)) == pytest.approx(
        {
            "copy_last, frames_only": (0.5 - 0.4375) / (2 / 3 - 0.4375),
            "vlm_7b, full_config": 1.0,
            "vlm_7b, no_materials": 0.0,
        }
    )
