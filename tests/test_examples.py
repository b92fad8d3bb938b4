"""Examples run as they are, on the smallest release."""

import base64
import os
import subprocess
import sys
from pathlib import Path

import cv2
import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from mpmworlds.sim.run.encode import decode_mp4

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture
def tour():
    return nbformat.read(EXAMPLES / "tour.ipynb", as_version=4)


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def outputs(notebook, kind):
    """Data of a type that the cells of a notebook have shown, in order."""
    return [
        output.data[kind]
        for cell in code_cells(notebook)
        for output in cell.outputs
        if kind in output.get("data", {})
    ]


def shown(page):
    """Frames of the video in a piece of HTML."""
    return decode_mp4(base64.b64decode(page.split("base64,")[1].split('"')[0]))


def printed(notebook):
    """What the cells of a notebook have printed."""
    return "".join(
        output.text
        for cell in code_cells(notebook)
        for output in cell.outputs
        if output.get("name") == "stdout"
    )


def test_notebook_is_valid_and_comes_without_outputs(tour):
    nbformat.validate(tour)
    assert [cell.outputs for cell in code_cells(tour)] == [[]] * len(code_cells(tour))
    assert {cell.execution_count for cell in code_cells(tour)} == {None}
    assert all(cell.metadata == {} for cell in tour.cells)


def test_notebook_installs_the_package_where_it_is_not(tour):
    first = code_cells(tour)[0].source
    assert first.index("import mpmworlds") < first.index("%pip install -q mpmworlds")


@pytest.mark.slow
def test_notebook_looks_links_runs_and_scores(tour, small, tmp_path, monkeypatch):
    (tmp_path / "release").mkdir()
    (tmp_path / "release/mpmworlds").symlink_to(small.release)
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(tour, timeout=60, resources=resources).execute()

    assert len(outputs(tour, "image/png")) == 2
    one, both = (shown(page) for page in outputs(tour, "text/html"))
    assert one.shape == (40, 64, 64, 3)
    assert both.shape == (40, 64, 128, 3)
    text = printed(tour)
    assert "ok: 80 frames" in text
    assert text.count("\n- GRAVITY = ") == text.count("\n+ GRAVITY = ") == 1
    rows = {line.split()[0]: line.split() for line in text.splitlines() if line}
    truth, weaker, still = map(float, rows["mask_iou"][1:4])
    assert truth == 1.0 > max(weaker, still)


@pytest.mark.slow
def test_sheets_of_a_release_are_drawn_into_one_picture(small, tmp_path):
    command = [sys.executable, EXAMPLES / "sheets.py", small.release]
    told = ["--frames", "3", "--size", "40", "--columns", "1"]
    for name in ("one.png", "again.png"):
        subprocess.run([*command, tmp_path / name, *told], check=True, env=os.environ)
    picture = cv2.imread(str(tmp_path / "one.png"))
    assert picture.shape == (2 * (20 + 44), 3 * 44, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 8
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "again.png").read_bytes()
