"""Single samples are written as files, from a folder and from the Hub."""

from mpmworlds.sim.run.encode import decode_mp4
from tests.hub import Hub


def test_a_sample_comes_as_files(command, corpus, release, tmp_path):
    out = tmp_path / "samples"
    status, told, err = command(
        "fetch", "p0002", "p0000", "--release", release, "--out", out
    )
    assert (status, err) == (0, "")
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
