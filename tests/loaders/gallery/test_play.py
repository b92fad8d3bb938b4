"""`mpmworlds play`: a scene or a sample on a page of its own."""

import json
import webbrowser

import pytest

from mpmworlds.builder.plan.lookup import recorded_rows
from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest
from mpmworlds.loaders.gallery.play import write_play
from mpmworlds.sim.run.encode import decode_mp4, frames_sha256
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, OBSTACLE, scene_data


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("MPMWORLDS_RELEASE", raising=False)
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def opened(monkeypatch):
    """Addresses that a browser would show."""
    addresses = []
    monkeypatch.setattr(webbrowser, "open", lambda url: addresses.append(url) or True)
    return addresses


@pytest.fixture
def scene(tmp_path):
    data = scene_data(BODY, OBSTACLE, frames=6, pixels=64)
    path = tmp_path / "mine.yaml"
    path.write_text(Scene.from_data(data).to_yaml())
    return path


def sample_of(page, name):
    text = (page.parent / f"samples/{name}.js").read_text("utf-8")
    return json.loads(text.removeprefix("onSample(").removesuffix(");\n"))


@pytest.mark.slow
def test_scene_is_rendered_and_opened(command, scene, opened, tmp_path):
    status, out, _ = command("play", scene)
    page = tmp_path / "work/play/mine/index.html"
    assert (status, out) == (0, "work/play/mine/index.html\n")
    assert opened == [page.as_uri()]
    sample = sample_of(page, "mine")
    assert sample["scene"] == scene.read_text()
    video = decode_mp4((page.parent / "videos/mine.mp4").read_bytes())
    assert frames_sha256(video) == sample["frames_sha256"]
    outcome = run(sample["program"], trusted=True)
    assert frames_sha256(outcome.expect()) == sample["frames_sha256"]


@pytest.mark.slow
def test_scene_that_was_changed_replaces_the_page(command, scene, opened, tmp_path):
    command("play", scene, "--no-open", "--out", tmp_path / "page")
    page = tmp_path / "page" / "index.html"
    before = sample_of(page, "mine")
    assert opened == []
    scene.write_text(
        scene.read_text().replace("duration_frames: 6", "duration_frames: 7")
    )
    command("play", scene, "--no-open", "--out", tmp_path / "page")
    after = sample_of(page, "mine")
    assert (before["num_frames"], after["num_frames"]) == (6, 7)


@pytest.mark.slow
def test_without_a_browser_one_is_told(command, scene, monkeypatch):
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    status, out, err = command("play", scene)
    assert (status, out) == (0, "work/play/mine/index.html\n")
    assert "open it yourself" in err


def test_page_of_a_sample_takes_its_video_from_a_release(release, corpus, tmp_path):
    from mpmworlds.loaders.gallery.source import find_video

    row = corpus.rows[1]
    found = find_video(row.id, row.program_sha256, release)
    page = write_play(found, tmp_path / "page", corpus.rows[0].scene)
    assert sample_of(page, row.id)["parent"] == corpus.rows[0].scene
    video = (page.parent / f"videos/{row.id}.mp4").read_bytes()
    assert video == found["video"]["bytes"]


def test_recorded_rows_are_those_of_the_manifest():
    rows = {row.id: row for row in read_manifest(recorded_manifest("tiny"))}
    names = sorted(rows)[:3]
    found = recorded_rows(names, "tiny")
    assert {name: found[name]["scene"] for name in names} == {
        name: rows[name].scene for name in names
    }


@pytest.mark.parametrize(
    ("options", "taken", "others"),
    [
        ([], "full", "tiny has another sample of this id; to take that: --config tiny"),
        (["--config", "tiny"], "tiny", ""),
        (
            ["--release", "TWO"],
            "tiny",
            "full has another sample of this id; to take that: --config full",
        ),
    ],
)
def test_which_corpus_a_sample_is_of_is_said(
    command, two_corpora, tmp_path, monkeypatch, options, taken, others
):
    shown = []
    monkeypatch.setattr(
        "mpmworlds.loaders.gallery.play.write_play",
        lambda row, out, parent: shown.append(row["scene"]) or out,
    )
    named = [two_corpora if option == "TWO" else option for option in options]
    status, _, err = command("play", "p0000", "--no-open", *named)
    assert (status, err.splitlines()) == (
        0,
        [
            f"p0000: of the recorded corpus {taken}",
            *([f"p0000: {others}"] if others else []),
        ],
    )
    assert shown == [recorded_rows(["p0000"], taken)["p0000"]["scene"]]


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("p9998-c7", "p9998-c7: is no sample of the corpus 'full'"),
        ("my-scene", "sample id 'my-scene': must be"),
        ("absent.yaml", "absent.yaml"),
    ],
)
def test_what_is_no_sample_is_named_in_a_line(source, message, command):
    status, _, err = command("play", source, "--no-open")
    assert status == 2
    assert message in err
    assert err.count("\n") == 1
