"""Score over budget."""

import pytest

from mpmworlds.baselines.report.board import boards, read_systems
from mpmworlds.baselines.report.budgets import spendings
from mpmworlds.baselines.report.figures import drawn, render
from mpmworlds.baselines.report.numbers import entries
from tests.baselines.made_results import result, write


def ran(root, name, minutes, *goodness, regime="frames_only"):
    options = {} if minutes is None else {"options": {"minutes": minutes}}
    rows = [[result(f"p{k:04d}", good)] for k, good in enumerate(goodness, 1)]
    return write(root / name, rows, predictor="search", regime=regime, **options)


def board_of(folders):
    (board,) = boards(read_systems([f"{folder.name}={folder}" for folder in folders]))
    return board


def test_a_metric_at_each_budget_the_smallest_first(tmp_path):
    folders = [
        ran(tmp_path, "long", 5, 1.0, 0.5),
        ran(tmp_path, "short", 1.0, 0.25, None),
        ran(tmp_path, "told", 5, 0.5, 0.5, regime="no_materials"),
    ]
    found = [s for s in spendings(entries(board_of(folders))) if s.metric == "mask_iou"]
    (line,) = found  # of one budget there is no line
    assert (line.predictor, line.regime) == ("search", "frames_only")
    assert line.minutes == (1.0, 5.0)
    assert line.labels == ("short, frames_only", "long, frames_only")
    assert [v.mean for v in line.values] == pytest.approx([0.125, 0.75])


def test_figure_is_there_only_where_budgets_differ(tmp_path):
    one = board_of([ran(tmp_path, "a", 5, 1.0), ran(tmp_path, "b", None, 0.5)])
    assert "budget" not in {name for name, _, _ in drawn(one, entries(one))}
    two = board_of([ran(tmp_path, "c", 1, 0.25), ran(tmp_path, "d", 10, 0.5)])
    (draw,) = [d for name, _, d in drawn(two, entries(two)) if name == "budget"]
    assert render(draw) == render(draw)
    assert render(draw)["png"].startswith(b"\x89PNG")
