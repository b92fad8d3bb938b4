"""Single samples are written as files, from a folder and from the Hub."""

import pytest

from mpmworlds.sim.run.encode import decode_mp4
from tests.hub import Hub


def test_a_sample_comes_as_files(command, corpus, release, tmp_path):
    out = tmp_path / "samples"
    status, told, err = command(
        "fetch", "p0002", "p0000", "--release", release, "--out", out
    )
    assert (status, err.splitlines()) == (
        0,
        [f"{name}: of mini of {release}" for name in ("p0002", "p0000")],
    )
    assert told.split() == [str(out / "p0002"), str(out / "p0000")]
    names = sorted(path.name for path in (out / "p0000").iterdir())
    assert names == ["clip.mp4", "program.py", "scene.yaml", "video.mp4"]
    assert (out / "p0000/program.py").read_text() == corpus.programs["p0000"]
    frames = decode_mp4((out / "p0000/video.mp4").read_bytes())
    assert (frames == corpus.frames["p0000"]).all()


def test_a_sample_that_is_not_there_is_named(command, release, tmp_path):
    out = tmp_path / "samples"
    status, _, err = command("fetch", "p0777", "--release", release, "--out", out)
    assert status == 2
    assert "p0777 is not in any of mini, tiny" in err
    assert "mpmworlds regenerate p0777" in err
    assert not out.exists()


@pytest.mark.parametrize(
    ("asked", "taken", "others", "remedy"),
    [
        (["p0002"], "mini-clips", "tiny has another sample", "tiny"),
        (["p0000"], "tiny", "recipes has another sample", "recipes"),
    ],
)
def test_of_several_corpora_full_is_taken_and_all_that_have_the_id_are_named(
    command, two_corpora, tmp_path, asked, taken, others, remedy
):
    options = ["fetch", *asked, "--release", two_corpora, "--out", tmp_path]
    status, _, err = command(*options)
    assert (status, err.splitlines()) == (
        0,
        [
            f"{asked[0]}: of {taken} of {two_corpora}",
            f"{asked[0]}: {others} of this id; to take that: --config {remedy}",
        ],
    )
    _, _, err = command(*options, "--config", remedy)
    assert err == f"{asked[0]}: of {remedy} of {two_corpora}\n"


@pytest.mark.parametrize("place", ["RELEASE", "nobody/nothing"])
def test_what_is_no_id_is_said_before_anything_is_read(
    command, release, tmp_path, place
):
    named = release if place == "RELEASE" else place
    status, _, err = command("fetch", "nope", "--release", named, "--out", tmp_path)
    assert status == 2
    assert "sample id 'nope': must be a parent 'p0123' or a seed 's07'" in err
    assert "regenerate" not in err


def test_what_is_no_release_is_said(command, tmp_path):
    status, _, err = command("fetch", "p0000", "--release", tmp_path)
    assert status == 2
    assert f"{tmp_path}: is no release" in err


def test_only_the_bytes_of_a_sample_are_sent(release, tmp_path):
    """The command in a process of its own: the address of the Hub is read at import."""
    import os
    import subprocess
    import sys

    with Hub(tmp_path / "hub") as hub:
        hub.serve(release, "acme/mpmworlds")
        hub.sent.clear()
        out = tmp_path / "out"
        command = [sys.executable, "-m", "mpmworlds", "fetch", "p0001-n00"]
        subprocess.run(
            [*command, "--release", "acme/mpmworlds", "--config", "tiny", "--out", out],
            env=os.environ | hub.environment(tmp_path / "hf"),
            check=True,
        )
        assert (out / "p0001-n00/video.mp4").is_file()
        files = {path for path in hub.sent if path.startswith("data/")}
        assert files == {
            "data/tiny/index.arrow",
            "data/tiny/train-00002-of-00003.arrow",
        }
        size = (release / "data/tiny/train-00002-of-00003.arrow").stat().st_size
        assert hub.sent["data/tiny/train-00002-of-00003.arrow"] < size


def test_a_revision_is_one_of_the_hub_though_a_release_is_here(
    command, release, tmp_path, monkeypatch
):
    asked = []

    def find(place, ids, config, revision):
        asked.append((place, revision))
        raise ValueError("stop")

    monkeypatch.setenv("MPMWORLDS_RELEASE", str(release))
    monkeypatch.setattr("mpmworlds.loaders.places.find_rows", find)
    command("fetch", "p0000", "--revision", "1.2.3", "--out", tmp_path)
    command("fetch", "p0000", "--out", tmp_path)
    assert asked == [("mpmworlds/mpmworlds", "1.2.3"), (str(release), None)]


def test_a_folder_has_no_revisions(command, release, tmp_path):
    named = ["--release", release, "--revision", "1.2.3"]
    status, _, err = command("fetch", "p0000", *named, "--out", tmp_path)
    assert status == 2
    assert f"{release}: is a folder, which has no revision '1.2.3'" in err
