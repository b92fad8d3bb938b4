"""Systems can be told apart wherever they are drawn."""

import pytest

from mpmworlds.baselines.report.board import boards, read_systems
from mpmworlds.baselines.report.figures import drawn
from mpmworlds.baselines.report.look import COLOURS, looks
from mpmworlds.baselines.report.numbers import entries
from tests.baselines.made_results import result, write


def test_systems_of_one_regime_have_colours_of_their_own(tmp_path):
    names = [f"system{k:02d}" for k in range(len(COLOURS))]
    folders = [
        write(tmp_path / name, [[result("p0001", 0.5)]], predictor=name)
        for name in names
    ]
    (board,) = boards(read_systems(map(str, folders)))
    found = list(looks(board).values())
    assert len({look.colour for look in found}) == len(names) == 14
    assert len({look.width for look in found}) == len(names)


def test_regimes_of_one_system_share_a_colour_and_differ_in_dash(folders):
    (board,) = boards(read_systems(map(str, folders)))
    told, untold = (
        looks(board)[f"vlm_7b, {regime}"] for regime in ("full_config", "no_materials")
    )
    assert told.colour == untold.colour
    assert told.dash != untold.dash
    assert told.mark != untold.mark


def test_legend_lies_within_its_figure(tmp_path):
    figure_of = pytest.importorskip("matplotlib.figure").Figure
    names = [f"system{k:02d}_of_a_name_that_is_rather_long" for k in range(12)]
    folders = [
        write(tmp_path / name, [[result("p0001", 0.5)]], predictor=name)
        for name in names
    ]
    (board,) = boards(read_systems(map(str, folders)))
    figures = {name: draw for name, _, draw in drawn(board, entries(board))}
    for name in ("wmae", "curves", "families"):
        figure = figure_of(layout="constrained")
        figures[name](figure)
        figure.canvas.draw()
        (legend,) = figure.legends
        box, whole = legend.get_window_extent(), figure.bbox
        assert whole.x0 <= box.x0 < box.x1 <= whole.x1
        assert whole.y0 <= box.y0 < box.y1 <= whole.y1
        assert len(legend.get_texts()) == len(names)
