"""The verbs that plan, render, release, check and evaluate a corpus."""

import json
import shutil
from dataclasses import replace

import pytest
import yaml

from mpmworlds.builder import materialise
from mpmworlds.builder.manifest import read_manifest, write_manifest
from mpmworlds.builder.materialise import Failure, Materialised
from mpmworlds.builder.release import build_release
from mpmworlds.builder.store import Store
from mpmworlds.splits.checksums import files_below, write_checksums
from tests.small import IDS, PARAMS


@pytest.fixture
def params(tmp_path):
    """Return a function: changes of the profile and of the rest -> params file."""

    def write(profile=None, **others):
        text = yaml.safe_dump(PARAMS | others)
        data = yaml.safe_load(text)
        data["profiles"]["tiny"] |= profile or {}
        path = tmp_path / "changed.yaml"
        path.write_text(yaml.safe_dump(data))
        return path

    return write


@pytest.fixture
def release_copy(small, tmp_path):
    return shutil.copytree(small.release, tmp_path / "release")


def bytes_below(folder):
    return {name: (folder / name).read_bytes() for name in files_below(folder)}


# ---- plan and splits


def test_plan_writes_the_manifest_and_says_how_many(command, small, tmp_path):
    path = tmp_path / "manifest.parquet"
    status, out, err = command("plan", "--params", small.params, "--out", path)
    assert (status, out) == (0, f"{path}: 2 scenes\n")
    assert "plan: 100%" in err
    assert path.read_bytes() == small.manifest.read_bytes()
    assert [(row.id, row.split) for row in read_manifest(path)] == [
        ("p0000", "test"),
        ("s04", "train"),
    ]


@pytest.mark.parametrize("verb", ["plan", "splits", "build"])
def test_unknown_profile_lists_the_profiles(verb, command, params, tmp_path):
    profile = PARAMS["profiles"]["tiny"]
    path = params(profiles={"tiny": profile, "huge": profile})
    place = "--dir" if verb == "splits" else "--out"
    options = ["--params", path, "--config", "grand", place, tmp_path / "out"]
    message = "profile 'grand' is not in params.yaml; it has ['huge', 'tiny']"
    assert command(verb, *options) == (
        2,
        "",
        f"mpmworlds {verb}: {message}\n",
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parents": "x"}, "parents = 'x', must be a whole number >= 0"),
        ({"children": -1}, "children = -1, must be a whole number >= 0"),
        ({"duration_frames": 0}, "duration_frames = 0, must be a whole number >= 1"),
        ({"seeds": ["s99"]}, "there is no seed 's99'; there are s00, s01"),
        ({"seeds": 4}, "profile 'tiny': 'int' object is not iterable"),
        ({"split": "salty"}, "profile 'tiny': "),
        ({"split": {"salt": "a"}}, "'test_fraction'"),
        ({"grid_resolution": 7}, "grid_resolution = 7, must be >= 32"),
        ({"colour": "red"}, "unexpected keyword argument 'colour'"),
    ],
    ids=str,
)
def test_impossible_profile_is_wrong_input(change, message, command, params, tmp_path):
    path = tmp_path / "manifest.parquet"
    status, out, err = command("plan", "--params", params(change), "--out", path)
    assert (status, out) == (2, "")
    assert message in err
    assert not path.exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("profiles: [", "is not YAML"),
        ("- tiny", "must be a mapping with the key 'profiles'"),
        ("profiles:", "profile 'tiny' is not in params.yaml; it has []"),
        ("profiles: {tiny: }", "profile 'tiny': 'NoneType' object is not iterable"),
        ("profiles: {tiny: {seeds: []}}", "'split' is missing; add it"),
    ],
)
def test_file_that_is_no_params_is_wrong_input(text, message, command, tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text(text)
    status, out, err = command("plan", "--params", path, "--out", tmp_path / "m")
    assert (status, out) == (2, "")
    assert message in err


def test_recorded_splits_pass_their_own_check(command, small, tmp_path):
    options = ["--params", small.params, "--dir", tmp_path / "lists"]
    assert command("splits", *options) == (
        0,
        f"{tmp_path / 'lists'}: train 1, modification_validation 0, test 1\n",
        "",
    )
    checked = (0, f"{tmp_path / 'lists'}: 2 ids, as computed\n", "")
    assert command("splits", "--check", *options) == checked
    assert command("splits", "--check", "--manifest", small.manifest, *options) == (
        checked
    )


def test_moved_id_fails_the_check_and_is_named(command, small, tmp_path):
    lists = tmp_path / "lists"
    options = ["--params", small.params, "--dir", lists]
    command("splits", *options)
    (lists / "train.txt").write_text("p0000\ns04\n")
    (lists / "test.txt").write_text("")
    before = bytes_below(lists)
    status, out, _ = command("splits", "--check", *options)
    assert status == 1
    assert "p0000: recorded in train, belongs to test" in out.splitlines()
    assert f"{lists / 'train.txt'}: sha256 " in out
    assert bytes_below(lists) == before


# ---- materialise and build


def test_first_build_renders_every_scene(small):
    assert small.stdout == f"{small.release}: 4 shards\n"
    assert f"{small.store}: 2 rendered, 0 there before, 0 failed" in small.stderr
    assert "materialise: 100%" in small.stderr
    assert "build: 100%" in small.stderr


def test_second_build_renders_nothing_and_gives_the_same_bytes(
    command, small, tmp_path
):
    out = tmp_path / "mpmworlds"
    status, _, err = command(
        *("build", "--params", small.params, "--manifest", small.manifest),
        *("--store", small.store, "--out", out),
    )
    assert status == 0
    assert f"{small.store}: 0 rendered, 2 there before, 0 failed" in err
    assert bytes_below(out) == bytes_below(small.release)


def test_materialise_records_the_hashes_of_all_videos(command, small, tmp_path):
    record = tmp_path / "record.jsonl"
    options = ["--manifest", small.manifest, "--store", small.store]
    status, out, err = command("materialise", *options, "--record", record)
    assert (status, out) == (0, "")
    assert "0 rendered, 2 there before, 0 failed" in err
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    assert [line["id"] for line in lines] == IDS
    rows = {row.id: row for row in read_manifest(small.manifest)}
    for line in lines:
        assert line["program_sha256"] == rows[line["id"]].program_sha256
        assert (line["num_frames"], line["resolution"]) == (80, 64)


def test_manifest_of_another_version_is_not_rendered(command, small, tmp_path):
    rows = read_manifest(small.manifest)
    path = tmp_path / "manifest.parquet"
    write_manifest(path, [replace(rows[0], program_sha256="0" * 64)])
    status, out, err = command(
        "materialise", "--manifest", path, "--store", tmp_path / "store"
    )
    assert (status, out) == (2, "")
    assert "p0000: the linked program's sha256 is " in err
    assert "plan it again or use that version" in err


@pytest.mark.parametrize("verb", ["materialise", "build"])
def test_failed_scene_is_named_and_nothing_is_made_of_the_rest(
    verb, command, small, tmp_path, monkeypatch
):
    done = Materialised(1, 0, (Failure("p0000", "crash: ended by SIGSEGV"),))
    monkeypatch.setattr(materialise, "materialise", lambda *_: done)
    out = tmp_path / "out"
    status, printed, err = command(
        *(verb, "--manifest", small.manifest, "--store", small.store),
        *("--record" if verb == "materialise" else "--out", out),
    )
    assert (status, printed) == (1, "")
    assert "1 rendered, 0 there before, 1 failed" in err
    assert "p0000: crash: ended by SIGSEGV" in err
    assert not out.exists()


def test_build_leaves_a_folder_of_something_else_alone(command, small, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    status, out, err = command(
        *("build", "--params", small.params, "--manifest", small.manifest),
        *("--store", small.store, "--out", tmp_path),
    )
    assert (status, out) == (2, "")
    assert f"{tmp_path}: holds 'thesis.tex' and no release" in err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"version": 1}, "version = 1, must be of type str"),
        ({"rows_per_shard": "x"}, "rows_per_shard = 'x', must be of type int"),
        ({"rows_per_shard": 0}, "rows_per_shard = 0, must be at least 1"),
    ],
    ids=str,
)
def test_impossible_setting_builds_nothing(
    setting, message, command, params, small, tmp_path
):
    status, out, err = command(
        *("build", "--params", params(**setting), "--manifest", small.manifest),
        *("--store", small.store, "--out", tmp_path / "release"),
    )
    assert (status, out) == (2, "")
    assert message in err
    assert not (tmp_path / "release").exists()


# ---- verify


def test_intact_release_is_verified(command, small):
    options = ["verify", small.release, "--resimulate", 0]
    assert command(*options) == (0, f"{small.release}: intact\n", "")
    status, out, err = command(*options, "--json")
    assert (status, err) == (0, "")
    assert json.loads(out) == {"release": str(small.release), "findings": []}


def test_damaged_file_is_found_and_named(command, release_copy):
    path = release_copy / "splits" / "test.txt"
    path.write_text("s04\n")
    status, out, err = command("verify", release_copy, "--resimulate", 0)
    assert (status, err) == (1, "")
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
    assert out.startswith("copy_last on tiny/test, mpmworlds-metrics/1\n2 samples, ")
    assert err.splitlines() == ["1/2 p0002 ok", "2/2 p0002-n00 ok"]
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
    assert (tmp_path / "work/results/black/summary.json").is_file()


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--predictor", "nobody", "must be one of ['black', 'copy_last', 'oracle']"),
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
    build_release(tmp_path / "m", store, out, {"tiny": None}, version="1.0.0")
    status, _, err = command(
        "evaluate", "--release", out, "--predictor", "black", "--out", tmp_path / "r"
    )
    assert status == 2
    assert "p0000: clip has 3 frames at 15 per second, must have more than 38" in err


def test_damaged_release_is_not_evaluated(command, release_copy, tmp_path):
    (shard,) = (release_copy / "data" / "tiny").glob("test-*.arrow")
    data = bytearray(shard.read_bytes())
    data[len(data) // 2] ^= 1
    shard.write_bytes(data)
    status, _, err = command(
        *("evaluate", "--release", release_copy, "--predictor", "black"),
        *("--out", tmp_path / "out"),
    )
    assert status == 2
    assert f"{shard}: its sha256 is not the one in SHA256SUMS" in err
    write_checksums(release_copy)
    assert command("verify", release_copy, "--resimulate", 0)[0] == 1
