"""The whole path, with real simulations: from a plan to recorded bits to a reader."""

import json
import os
import subprocess
import sys
from dataclasses import asdict
from functools import cache
from pathlib import Path

import pytest
import yaml

from mpmworlds.builder.manifest import text_sha256
from mpmworlds.builder.plan import Profile, plan
from mpmworlds.builder.store import Store
from mpmworlds.sim.encode import decode_mp4
from mpmworlds.sim.link import link
from mpmworlds.sim.run import run

ROOT = Path(__file__).resolve().parents[1]


@cache
def recorded():
    """Return the recorded hashes of the tiny corpus by id."""
    lines = (ROOT / "builder/recorded/tiny.jsonl").read_text().splitlines()
    return {record.pop("id"): record for record in map(json.loads, lines)}


def first_planned(materials):
    """Return the first sample of the tiny corpus that has one of the materials."""
    params = yaml.safe_load((ROOT / "params.yaml").read_text())
    for draft in plan(Profile.from_params(params, "tiny")):
        found = {
            thing.physics_properties.constitutive_model
            for thing in draft.kept.objects
            if thing.object_type in ("dynamic_body", "emitter")
        }
        if found & materials:
            return draft
    raise AssertionError(f"tiny has no sample with any of {sorted(materials)}")


@pytest.mark.slow
@pytest.mark.parametrize(
    "materials", [{"sand", "snow"}, {"liquid"}], ids=["granular", "liquid"]
)
def test_recorded_sample_is_made_again_bit_for_bit(materials, tmp_path):
    draft = first_planned(materials)
    record, program = recorded()[str(draft.id)], link(draft.kept)
    message = (
        f"{draft.id}: not as in builder/recorded/tiny.jsonl; if that is meant, raise "
        "`version` in params.yaml, run `dvc repro` and commit what it records"
    )
    assert text_sha256(program) == record["program_sha256"], message
    frames = run(program).expect()
    found = Store(tmp_path).put(program, frames, draft.kept.output.framerate)
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
    assert "copy_last on tiny/test, mpmworlds-metrics/1" in done.stdout
    video = decode_mp4((tmp_path / "work" / "quickstart.mp4").read_bytes())
    assert video.shape == (80, 64, 64, 3)
