"""The DVC pipeline: what is recorded is in step, and a change reruns what it touches.

DVC runs on a copy of the files of this checkout, in its state of now.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from mpmworlds.builder.plan.manifest import read_manifest
from mpmworlds.builder.plan.profile import NOT_PLANNED
from mpmworlds.cli import main
from tests.checkout import Checkout
from tests.small import PARAMS

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.skipif(
    not (ROOT / ".git").exists(), reason="needs a git checkout, to see what is in git"
)
STAGES = ["plan@tiny", "split@tiny", "materialise", "build", "evaluate"]  # of tiny
FULL = ["plan@full", "measure-full", "split@full", "audit-full", "statistics-full"]


@pytest.fixture
def checkout(tmp_path):
    return Checkout.of_now(tmp_path)


def stages_of(text):
    """Return the stages of dvc.yaml, those for each corpus one by one."""
    stages = {}
    for name, stage in yaml.safe_load(text)["stages"].items():
        each = stage.get("foreach", [None])  # a list, or a mapping
        for key in each:
            told = json.dumps(stage.get("do", stage))
            told = re.sub(r"\$\{(item|key)\}", str(key), told)
            for field, value in (each[key] if isinstance(each, dict) else {}).items():
                told = told.replace(f"${{item.{field}}}", value)
            stages[f"{name}@{key}" if key else name] = json.loads(told)
    return stages


def outs_of(stage):
    """Return the outputs of a stage of dvc.yaml."""
    entries = [*stage.get("outs", ()), *stage.get("metrics", ())]
    return [next(iter(e)) if isinstance(e, dict) else e for e in entries]


def out_of_step(status, absent):
    """Yield what `dvc status` finds, except that generated files are absent."""
    for stage, findings in status.items():
        for finding in findings:
            parts = finding.items() if isinstance(finding, dict) else [(finding, {})]
            for what, paths in parts:
                if not paths:
                    yield f"{stage}: {what}"
                for path, change in paths.items():
                    if path not in absent:
                        yield f"{stage}: {what}: {path}: {change}"


def test_lock_is_in_step_with_sources_parameters_and_commands(checkout):
    stages = stages_of(checkout.read("dvc.yaml"))
    locked = yaml.safe_load(checkout.read("dvc.lock"))["stages"]
    assert set(stages) == set(locked) == {"sources", *FULL, *STAGES}
    outs = {out for stage in stages.values() for out in outs_of(stage)}
    absent = {out for out in outs if not (checkout.folder / out).exists()}
    status = json.loads(checkout.dvc("status", "--json"))
    findings = list(out_of_step(status, absent))
    advice = (
        "dvc.lock is not of these files; if a video changed, raise `version` in "
        "params.yaml; then run `dvc repro` and commit what it records:"
    )
    assert not findings, "\n".join([advice, *findings])


def test_every_dependency_and_small_output_is_in_git():
    stages = stages_of((ROOT / "dvc.yaml").read_text())
    listed = ["git", "ls-files", "-co", "--exclude-standard"]
    done = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True)
    files = set(done.stdout.splitlines())
    held = files | {str(p) for name in files for p in Path(name).parents}
    generated = {out for stage in stages.values() for out in outs_of(stage)}
    for name, stage in stages.items():
        missing = set(stage["deps"]) - held - generated
        assert not missing, f"stage {name} depends on files that are not in git"
    assert {"builder/recorded/tiny.jsonl", "splits/recorded/tiny"} <= held & generated


def test_plans_depend_on_all_that_a_profile_says_of_them():
    """Settings of lists and files are read later: they plan nothing anew."""
    stages = stages_of((ROOT / "dvc.yaml").read_text())
    profiles = yaml.safe_load((ROOT / "params.yaml").read_text())["profiles"]
    for name in ("tiny", "full"):
        keys = [key for key in profiles[name] if key not in NOT_PLANNED]
        expected = {
            "root_seed",
            "tables.v1",
            *(f"profiles.{name}.{key}" for key in keys),
        }
        assert set(stages[f"plan@{name}"]["params"]) == expected


def test_recorded_lists_and_hashes_are_those_of_the_plan(tmp_path, capsys):
    manifest = tmp_path / "manifest.parquet"
    assert main(["plan", "--config", "tiny", "--out", str(manifest)]) == 0
    lists = ["--dir", str(ROOT / "splits/recorded/tiny"), "--manifest", str(manifest)]
    assert main(["splits", "--check", *lists]) == 0, capsys.readouterr().out
    lines = (ROOT / "builder/recorded/tiny.jsonl").read_text().splitlines()
    recorded = {r["id"]: r["program_sha256"] for r in map(json.loads, lines)}
    planned = {row.id: row.program_sha256 for row in read_manifest(manifest)}
    assert recorded == planned, (
        "builder/recorded/tiny.jsonl is of other programs: run `dvc repro`"
    )


@pytest.mark.slow
def test_change_reruns_the_stages_that_it_touches_and_no_other(checkout, small):
    tables = yaml.safe_load((ROOT / "params.yaml").read_text())["tables"]
    params = PARAMS | {"tables": tables}
    (checkout.folder / "params.yaml").write_text(yaml.safe_dump(params))
    shutil.copytree(small.store, checkout.folder / "work/store")  # rendered already
    assert checkout.repro() == STAGES
    assert list((checkout.folder / "metrics").glob("__pycache__/*.pyc"))
    assert checkout.repro() == []

    # A comment is no code, and a note even less.
    with (checkout.folder / "sim/run/encode.py").open("a") as stream:
        stream.write("# a comment\n")
    (checkout.folder / "sim/notes.md").write_text("a note\n")
    assert checkout.repro() == ["sources"]
    assert checkout.repro() == []

    # One row in each file before and after: the release is the same, so the scores are.
    release = checkout.read("release/mpmworlds/SHA256SUMS")
    checkout.set("rows_per_shard: 4\n", "rows_per_shard: 1\n")
    assert checkout.repro() == ["build"]
    assert checkout.read("release/mpmworlds/SHA256SUMS") == release

    checkout.set("predictor: copy_last", "predictor: black")
    assert checkout.repro() == ["evaluate"]
    summary = json.loads(checkout.read("work/tiny/results/summary.json"))
    assert summary["provenance"]["predictor"] == "black"

    # Under this salt the parent, too, is in train. No scene changes, so no video does.
    record = checkout.read("builder/recorded/tiny.jsonl")
    assert checkout.read("splits/recorded/tiny/test.txt") == b"p0000\n"
    checkout.set("salt: tiny-1", "salt: tiny-9")
    assert checkout.repro() == STAGES
    assert checkout.read("builder/recorded/tiny.jsonl") == record
    assert checkout.read("splits/recorded/tiny/train.txt") == b"p0000\ns04\n"
