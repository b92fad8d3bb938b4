"""The verbs that verify a release and evaluate a predictor on it."""

import json
import shutil

import pytest

from mpmworlds.builder.plan.manifest import write_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.store import Store
from mpmworlds.files.checksums import write_checksums
from mpmworlds.metrics import VERSION


@pytest.fixture
def release_copy(small, tmp_path):
    return shutil.copytree(small.release, tmp_path / "release")


# ---- verify


def test_intact_release_is_verified(command, small):
    options = ["verify", small.release, "--resimulate", 0]
    assert command(*options)[:2] == (0, f"{small.release}: intact\n")
    status, out, err = command(*options, "--json")
    assert (status, "verify: 100%" in err) == (0, True)
    assert json.loads(out) == {"release": str(small.release), "findings": []}


def test_damaged_file_is_found_and_named(command, release_copy):
    path = release_copy / "splits" / "test.txt"
    path.write_text("s04\n")
    status, out, err = command("verify", release_copy, "--resimulate", 0)
    assert (status, "verify: 100%" in err) == (1, True)
    assert f"{path}: its sha256 is not the one in SHA256SUMS" in out.splitlines()
    findings = out.splitlines()
    status, out, _ = command("verify", release_copy, "--resimulate", 0, "--json")
    assert (status, json.loads(out)["findings"]) == (1, findings)


def test_number_of_simulations_cannot_be_negative(command, small):
    status, out, err = command("verify", small.release, "--resimulate", -1)
    assert (status, out) == (2, "")
    assert "resimulate = -1, must be at least 0" in err


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
        ("--config", "grand", "has no split grand/test"),
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
