"""Where nothing can be written, a command says so before it does anything."""

import tempfile

import pytest

RUN = ["run", "{program}", "--unsafe-no-sandbox"]
BUILD = ["build", "--manifest", "{manifest}", "--store", "{store}"]
MATERIALISE = ["materialise", *BUILD[1:]]
EVALUATE = ["evaluate", "--predictor", "black", "--release", "{release}"]
CASES = [
    (RUN, "--out", "{folder}"),
    (RUN, "--out", "{file}/video.mp4"),
    (RUN, "--sheet", "{folder}"),
    (RUN, "--states", "{folder}"),
    (["link", "{scene}"], "--out", "{folder}"),
    (["plan"], "--out", "{folder}"),
    (["plan", "--out", "{store}"], "--record-trials", "{folder}"),
    (["measure", "--manifest", "{manifest}"], "--out", "{folder}"),
    (BUILD, "--out", "{file}"),
    (BUILD, "--out", "{file}/new/release"),
    (BUILD, "--out", "{folder}"),  # which holds something else
    (MATERIALISE, "--record", "{folder}"),
    (MATERIALISE, "--record", "{file}/record.jsonl"),
    (MATERIALISE, "--failures", "{folder}"),
    (MATERIALISE, "--store", "{file}"),
    (["export", "sft", "--release", "{release}"], "--out", "{file}"),
    (["export", "video", "--release", "{release}"], "--out", "{file}/new"),
    (EVALUATE, "--out", "{file}"),
    ([*EVALUATE, "--workers", "1"], "--out", "{file}/new"),
    (["report", "{folder}"], "--out", "{file}"),
    (["gate", "--fit", "{folder}", "{folder}"], "--out", "{file}"),
    (["stats", "--manifest", "{manifest}"], "--figure", "{file}/statistics.png"),
]


@pytest.fixture
def places(small, release, tmp_path):
    """Paths by what the cases call them."""
    folder, file, ran = (tmp_path / name for name in ("folder", "file", "ran"))
    folder.mkdir()
    (folder / "mine").write_text("mine")
    file.write_text("mine")
    (tmp_path / "program.py").write_text(f"open({str(ran)!r}, 'w').close()\n")
    return {
        "folder": folder,
        "file": file,
        "program": tmp_path / "program.py",
        "scene": tmp_path / "scene.yaml",
        "manifest": small.manifest,
        "release": release,
        "store": tmp_path / "store",
    }


@pytest.mark.parametrize(
    ("arguments", "option", "value"),
    CASES,
    ids=[f"{case[0]} {option} {value}" for case, option, value in CASES],
)
def test_a_place_that_cannot_be_written_is_told_before_anything_is_done(
    arguments, option, value, places, command, tmp_path, monkeypatch
):
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "no room for programs"))
    monkeypatch.chdir(tmp_path)
    given = [text.format(**places) for text in (*arguments, option, value)]
    status, out, err = command(*given)
    assert (status, out) == (2, "")
    assert err.startswith(f"mpmworlds {arguments[0]}: {given[-1]}: ")
    assert "name an" in err  # other place
    assert sorted(tmp_path.rglob("*")) == before
