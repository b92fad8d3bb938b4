"""An evaluation that lacks samples is said to, wherever its numbers stand."""

import csv
import json
from dataclasses import replace

import pytest

from mpmworlds.baselines.report.board import Split, boards, read_systems
from mpmworlds.baselines.report.look import looks
from mpmworlds.baselines.report.write import write_report
from tests.baselines.made_results import result, summarise, write

SAMPLES = ("p0001", "p0002")
NOTE = (
    "black, frames_only on test: INCOMPLETE, results of 2 of 4 samples; nothing can be "
    "said of p0003 and 1 more: the server timed out."
)


@pytest.fixture
def folders(tmp_path):
    """One that is complete, and one whose summary says what it lacks."""
    samples = [[result(sample, 0.5)] for sample in SAMPLES]
    whole = write(tmp_path / "whole", samples)
    part = write(tmp_path / "part", samples, predictor="black")
    told = {"p0004": "no answer", "p0003": "the server timed out"}
    summarise(part, 2, expected=4, troubles=told)
    return [str(whole), str(part)]


@pytest.fixture
def report(folders, tmp_path, monkeypatch):
    monkeypatch.setattr("mpmworlds.baselines.report.write.drawn", lambda *_: ())
    out = tmp_path / "out"
    write_report(folders, out)
    return out


def test_every_table_says_so(report):
    text = (report / "data.js").read_text()
    page = json.loads(text.removeprefix("onReport(").removesuffix(");\n"))
    (section,) = page["sections"]
    for table in section["tables"]:
        assert NOTE in table["notes"]
        ours = [
            dict(zip(table["columns"], row, strict=True))
            for group in table["groups"]
            for row in group["rows"]
            if row[table["columns"].index("evaluated")] == "2/4"
        ]
        systems = {row["system"] for row in ours}
        # Of the one that is whole by its own summary the split has more, too.
        assert systems == {"black (incomplete)", "copy_last (incomplete)"}
    tables = len(section["tables"])
    note = NOTE.replace("_", r"\_")
    assert (report / "report.md").read_text().count(note) == tables + 1
    assert (report / "report.tex").read_text().count(note) == tables


def test_page_and_numbers_say_so(report):
    assert NOTE in json.loads((report / "report.json").read_text())["notes"]
    assert NOTE in (report / "data.js").read_text().partition('"sections"')[0]
    with (report / "numbers.csv").open() as stream:
        assert {row["complete"] for row in csv.DictReader(stream)} == {"false"}


def test_legends_say_so(folders):
    (board,) = boards(read_systems(folders))
    names = [look.name for look in looks(board).values()]
    assert names == [
        "black, frames_only (incomplete)",
        "copy_last, frames_only (incomplete)",
    ]


def test_command_says_so_in_a_line(command, folders, tmp_path, monkeypatch):
    monkeypatch.setattr("mpmworlds.baselines.report.write.drawn", lambda *_: ())
    status, out, err = command("report", *folders, "--out", tmp_path / "out")
    assert status == 0
    assert NOTE in err.splitlines()
    assert NOTE in out.splitlines()
    assert "black (incomplete)" in out


def test_what_cannot_be_compared_for_it_says_so(command, folders, tmp_path):
    more = [[result(sample, 0.5)] for sample in (*SAMPLES, "p0003")]
    other = write(tmp_path / "more", more, predictor="other")
    status, _, err = command("report", *folders, other, "--out", tmp_path / "out")
    assert status == 2
    (line,) = err.splitlines()
    assert f"{folders[1]} is incomplete: 2 of 4 samples; evaluate both" in line


def test_whole_evaluation_is_not_said_to_lack_anything(folders):
    (board,) = boards(read_systems(folders[:1]))
    assert board.warnings == []
    assert [look.name for look in looks(board).values()] == ["copy_last, frames_only"]


def test_release_tells_how_many_there_should_be(folders):
    splits = {("tiny", "test"): Split([*SAMPLES, "p0003"], 15)}
    (board,) = boards(read_systems(folders[:1]), splits, common=True)
    assert board.warnings == [
        "copy_last, frames_only on test: INCOMPLETE, results of 2 of 3 samples."
    ]


def test_trouble_alone_is_enough(folders):
    (board,) = boards(read_systems(folders[:1]))
    told = replace(board.systems[0].told, troubles={"p0009": "full disk"})
    (troubled,) = (replace(system, told=told) for system in board.systems)
    assert not replace(board, systems=(troubled,)).complete(troubled)
