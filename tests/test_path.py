"""The whole path, with real simulations: from a plan to recorded bits to a reader."""

import json
import os
import re
import subprocess
import sys
from dataclasses import asdict
from functools import cache
from pathlib import Path

import pytest
import yaml

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.plan.plan import write_plan
from mpmworlds.builder.plan.profile import Profile
from mpmworlds.builder.plan.trials import RECORDED
from mpmworlds.builder.render.store import Store
from mpmworlds.metrics import VERSION
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene

ROOT = Path(__file__).resolve().parents[1]


@cache
def recorded():
    """Return the recorded hashes of the tiny corpus by id."""
    lines = (ROOT / "builder/recorded/tiny.jsonl").read_text().splitlines()
    return {record.pop("id"): record for record in map(json.loads, lines)}


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """Rows of the tiny corpus."""
    params = yaml.safe_load((ROOT / "params.yaml").read_text())
    path = tmp_path_factory.mktemp("plan") / "manifest.parquet"
    return write_plan(Profile.from_params(params, "tiny"), path, trials=RECORDED).rows


@pytest.mark.slow
@pytest.mark.parametrize(
    "materials", [{"sand", "snow"}, {"liquid"}], ids=["granular", "liquid"]
)
def test_recorded_sample_is_made_again_bit_for_bit(planned, materials, tmp_path):
    row = next((row for row in planned if materials & set(row.materials)), None)
    assert row, f"tiny has no sample with any of {sorted(materials)}"
    scene = Scene.from_yaml(row.scene)
    record, program = recorded()[row.id], link(scene)
    message = (
        f"{row.id}: not as in builder/recorded/tiny.jsonl; if that is meant, raise "
        "`version` in params.yaml, run `dvc repro` and commit what it records"
    )
    assert text_sha256(program) == record["program_sha256"], message
    frames = run(program).expect()
    found = Store(tmp_path).put(program, frames, scene.output.framerate)
    assert asdict(found) == record, message


def test_quickstart_prints_a_sample_and_the_table(small, tmp_path):
    (tmp_path / "release").mkdir()
    (tmp_path / "release" / "mpmworlds").symlink_to(small.release)
    apart = {"HF_HOME": str(tmp_path / "hf"), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    environment = {k: v for k, v in os.environ.items() if k != "MPMWORLDS_RELEASE"}
    done = subprocess.run(
        [sys.executable, ROOT / "examples" / "quickstart.py"],
        cwd=tmp_path,
        env=environment | apart | {"HF_HUB_OFFLINE": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "              id  p0000\n" in done.stdout
    assert "prefix (38, 64, 64, 3), continuation (2, 64, 64, 3)" in done.stdout
    assert f"copy_last on tiny/test, frames_only, {VERSION}" in done.stdout
    for column in ("video", "clip"):
        assert re.search(rf"^ +{column}  MP4, \d+ bytes$", done.stdout, re.MULTILINE)
    assert "b'" not in done.stdout
    video = decode_mp4((tmp_path / "work" / "quickstart.mp4").read_bytes())
    assert video.shape == (80, 64, 64, 3)
