"""The verbs that verify a release and evaluate a predictor on it."""

import json
import os
import shutil
import subprocess
import sys

import cv2
import numpy as np
import pytest

from mpmworlds.builder.plan.manifest import write_manifest
from mpmworlds.builder.release import regenerate
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.rows import any_row, namesakes
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.store import Store
from mpmworlds.files.checksums import write_checksums
from mpmworlds.metrics import VERSION
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.run.run import Outcome
from mpmworlds.sim.scene.scene import Scene


def nudged(frames):
    """The frames with one pixel of another colour of theirs."""
    other, colours = frames.copy(), frames[-1].reshape(-1, 3)
    other[-2, 0, 0] = colours[colours.any(axis=1)][0]
    return other


@pytest.fixture
def release_copy(small, tmp_path):
    return shutil.copytree(small.release, tmp_path / "release")


# ---- verify


def test_intact_release_is_verified(command, small):
    options = ["verify", small.release, "--resimulate", 0]
    assert command(*options)[:2] == (0, f"{small.release}: intact\n")
    status, out, err = command(*options, "--json", "--seed", "3")
    assert (status, "verify: 100%" in err) == (0, True)
    assert json.loads(out) == {
        "release": str(small.release),
        "findings": [],
        "seed": "3",
        "simulated": [],
        "recorded": [],
        "videos": True,
    }


def test_a_row_that_is_drawn_is_simulated_again(command, small):
    status, out, err = command("verify", small.release, "--seed", "3")
    assert (status, out) == (0, f"{small.release}: intact\n")
    assert "simulated again: exact: all 80 frames are equal, bit for bit" in err
    assert "--seed 3 draws them again" in err


def test_damaged_file_is_found_and_named(command, release_copy):
    path = release_copy / "splits" / "test.txt"
    path.write_text("s04\n")
    status, out, err = command("verify", release_copy, "--resimulate", 0)
    assert (status, "verify: 100%" in err) == (1, True)
    findings = out.splitlines()
    fault = f"{path}: its sha256 is not the one in SHA256SUMS; fetch the file again, or"
    assert any(line.startswith(fault) for line in findings)
    status, out, _ = command("verify", release_copy, "--resimulate", 0, "--json")
    found = json.loads(out)["findings"]
    assert (status, len(found)) == (1, len(findings))
    assert {"file", "fault", "remedy", "row"} == found[0].keys()


def test_videos_can_be_left_out(command, release_copy):
    status, out, err = command("verify", release_copy, "--no-videos")
    assert (status, out) == (0, f"{release_copy}: intact\n")
    assert "videos were not decoded" in err


def test_number_of_simulations_cannot_be_negative(command, small):
    status, out, err = command("verify", small.release, "--resimulate", -1)
    assert (status, out) == (2, "")
    assert "resimulate = -1, must be at least 0" in err


@pytest.mark.parametrize("closed", ["stdout", "stderr", "both"])
@pytest.mark.parametrize("damaged", [False, True])
def test_the_status_is_right_though_nobody_reads(release_copy, damaged, closed):
    if damaged:
        (release_copy / "splits" / "test.txt").write_text("s04\n")
    reader, writer = os.pipe()
    os.close(reader)
    streams = ("stdout", "stderr") if closed == "both" else (closed,)
    given = dict.fromkeys(("stdout", "stderr"), subprocess.DEVNULL)
    options = ["verify", release_copy, "--no-videos", "--workers", 1]
    with os.fdopen(writer, "w") as pipe:
        done = subprocess.run(
            [sys.executable, "-m", "mpmworlds", *map(str, options)],
            **given | dict.fromkeys(streams, pipe),
            check=False,
            timeout=120,
        )
    assert done.returncode == damaged


# ---- regenerate


def test_a_sample_is_made_anew_and_equal(command, small, tmp_path):
    options = ["regenerate", "s04", "--release", small.release, "--out", tmp_path]
    status, out, err = command(*options, "--verify")
    assert (status, err) == (0, f"s04: of {small.release}: tiny\n")
    *paths, told = out.splitlines()
    assert told == "s04: exact: all 80 frames are equal, bit for bit"
    names = ["scene.yaml", "program.py", "video.mp4", "sheet.png"]
    assert paths == [str(tmp_path / name) for name in names]
    scene = Scene.from_yaml((tmp_path / "scene.yaml").read_text())
    assert (tmp_path / "program.py").read_text() == link(scene)
    assert len(decode_mp4((tmp_path / "video.mp4").read_bytes())) == 80
    assert cv2.imread(str(tmp_path / "sheet.png")) is not None


@pytest.mark.parametrize(
    ("change", "status", "told"),
    [
        (lambda frames: frames, 0, "exact: all 80 frames are equal, bit for bit"),
        (nudged, 0, "within metric tolerance, not bit for bit"),
        (lambda frames: frames[::-1], 1, "neither equal nor within metric tolerance"),
        (lambda frames: frames[:40], 1, "neither equal nor alike"),
    ],
)
def test_the_tier_that_holds_is_said(
    command, small, tmp_path, monkeypatch, change, status, told
):
    stored = any_row(small.release, "s04")[1]
    frames = change(decode_mp4(stored["video"]["bytes"]))
    outcome = Outcome("ok", frames, 1.0, "")
    monkeypatch.setattr(regenerate, "run", lambda program, **options: outcome)
    options = ["--release", small.release, "--out", tmp_path, "--verify", "--json"]
    found, out, _ = command("regenerate", "s04", *options)
    assert (found, json.loads(out)["text"].startswith(told)) == (status, True), out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["../x"], "sample id '../x': must be a parent"),
        (["p9999"], "p9999: is not in the corpus 'full'"),
        (["p0000", "--config", "grand"], "there is no recorded manifest of 'grand'"),
        (["p9999", "--release", "RELEASE"], "has no row 'p9999' in any configuration"),
        (
            ["s04", "--release", "RELEASE", "--config", "grand"],
            "no configuration 'gran",
        ),
        (["s04", "--release", "absent"], "absent/release.json: is not there"),
        (
            ["s04", "--verify", "--release", "RELEASE", "--config", "recipes"],
            "recipes has no video of it to compare with",
        ),
        (["s04", "--verify"], "there is no release here to compare with"),
    ],
)
def test_what_cannot_be_made_anew_is_wrong_use(
    command, small, options, message, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MPMWORLDS_RELEASE", raising=False)
    named = [small.release if option == "RELEASE" else option for option in options]
    status, out, err = command("regenerate", *named)
    assert (status, out) == (2, "")
    assert message in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("sample", "taken", "others"),
    [("p0002", "mini-clips", ["tiny"]), ("p0000", "tiny", ["recipes"])],
)
def test_of_several_corpora_a_row_of_full_is_found_first(
    two_corpora, sample, taken, others
):
    config, row = any_row(two_corpora, sample)
    assert (config, "clip" in row) == (taken, True)
    assert namesakes(two_corpora, sample, config) == others
    assert any_row(two_corpora, sample, others[0])[0] == others[0]


def test_which_recorded_corpus_is_taken_is_said(command, tmp_path, monkeypatch):
    frames = np.zeros((2, 64, 64, 3), np.uint8)
    outcome = Outcome("ok", frames, 1.0, "")
    monkeypatch.setattr(regenerate, "run", lambda program, **options: outcome)
    status, _, err = command("regenerate", "p0000", "--out", tmp_path)
    assert (status, err.splitlines()) == (
        0,
        [
            "p0000: of the recorded corpus full",
            "p0000: tiny has another sample of this id; to take that: --config tiny",
        ],
    )
    _, _, err = command("regenerate", "p0000", "--out", tmp_path, "--config", "tiny")
    assert err == "p0000: of the recorded corpus tiny\n"


# ---- evaluate


def test_evaluation_prints_its_table_and_writes_its_files(command, release, tmp_path):
    options = ["--release", release, "--predictor", "copy_last", "--out", tmp_path]
    status, out, err = command("evaluate", *options)
    assert status == 0
    assert out.startswith(
        f"copy_last on tiny/test, frames_only, {VERSION}\n2 samples, "
    )
    for part in ("copy_last, frames_only: 100%", "2/2", "troubled=0"):
        assert part in err
    names = ["results.jsonl", "summary.json", "summary.txt"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    status, out, _ = command("evaluate", *options, "--json")
    assert status == 0
    assert json.loads(out) == json.loads((tmp_path / "summary.json").read_text())


def test_results_lie_below_work_unless_told_otherwise(
    command, release, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    options = ["--release", release, "--predictor", "black", "--limit", 1]
    status, out, _ = command("evaluate", *options)
    assert status == 0
    assert "1 samples" in out
    assert (tmp_path / "work/results/black-frames_only/summary.json").is_file()


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--predictor", "nobody", "unknown, must be one of ['black', 'codec', "),
        ("--split", "exam", "has no split tiny/exam; it has mini/test, mini/train"),
        ("--config", "grand", "has no configuration 'grand'; it has"),
        ("--limit", "0", "limit = 0, must be at least 1"),
    ],
)
def test_what_cannot_be_evaluated_is_wrong_use(
    option, value, message, command, release, tmp_path
):
    options = {"--release": release, "--predictor": "black", "--out": tmp_path / "out"}
    pairs = (options | {option: value}).items()
    status, out, err = command("evaluate", *[part for pair in pairs for part in pair])
    assert (status, out) == (2, "")
    assert message in err
    assert not (tmp_path / "out").exists()


def test_video_without_a_continuation_is_named(
    command, make_program, make_row, run_inline, tmp_path
):
    program = make_program(0, frames=6)
    store = Store(tmp_path / "store")
    store.put(program, run_inline(program), framerate=30)
    write_manifest(tmp_path / "m", [make_row("p0000", "test", program)])
    out = tmp_path / "release"
    planned = Corpus(tmp_path / "m", {"tiny": None})
    build_release([planned], store, out, version="1.0.0")
    status, _, err = command(
        "evaluate", "--release", out, "--predictor", "black", "--out", tmp_path / "r"
    )
    assert status == 2
    assert "p0000: clip has 3 frames at 15 per second, must have more than 38" in err


def test_damaged_release_is_not_evaluated(command, release_copy, tmp_path):
    (shard,) = (release_copy / "data" / "tiny").glob("test-*.arrow")
    data = bytearray(shard.read_bytes())
    data[data.index(b"mdat") + 1000] ^= 1  # of a video, after what the encoder says
    shard.write_bytes(data)
    status, _, err = command(
        *("evaluate", "--release", release_copy, "--predictor", "black"),
        *("--out", tmp_path / "out"),
    )
    assert status == 2
    assert f"{shard}: its sha256 is not the one in SHA256SUMS" in err
    write_checksums(release_copy)
    assert command("verify", release_copy, "--resimulate", 0)[0] == 1
