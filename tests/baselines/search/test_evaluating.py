"""Search is evaluated like every predictor: stopped, resumed, shared out, kept."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

from mpmworlds.baselines.evaluate import evaluate
from mpmworlds.baselines.results import read_results
from mpmworlds.baselines.scoring import score_example
from mpmworlds.baselines.search.predictor import ProgramSearch
from mpmworlds.loaders.load import Example
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.metrics.reduction import reduce_clip, split_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from tests.baselines.search.worlds import world

OPTIONS = {"runs": 4, "candidates": 2}
FORM = VideoForm(70, 15, 128)


@pytest.fixture(scope="module")
def sample():
    """A ball that falls to the floor: 38 frames, and 32 to predict."""
    scene = world("ball", "wall", form=FORM)
    frames = reduce_clip(run(link(scene), trusted=True).expect(), FORM.framerate)
    row = {
        "id": "p0001",
        "family_id": "p0001",
        "materials": ["snow"],
        "object_types": ["dynamic_body", "static_collider"],
        "num_objects": 2,
        "motion": None,
        "ceiling": None,
        "num_frames": FORM.frames,
        "framerate": FORM.framerate,
        "resolution": FORM.pixels,
        "scene": scene.to_yaml(),
        "program": "",
    }
    return Example("p0001", *split_clip(frames, 15), 15, row)


@pytest.mark.slow
@pytest.mark.parametrize("regime", REGIMES)
def test_every_regime_leads_to_a_scene_that_is_scored_and_kept(sample, regime):
    told = Example(
        sample.id,
        sample.prefix,
        sample.continuation,
        sample.framerate,
        sample.row,
        regime=REGIMES[regime],
    )
    found = score_example(told, ProgramSearch(**OPTIONS))
    assert {result.outcome for result in found.results} <= {"ok", "passed_over"}
    best = max(r.continuation["mask_iou"] for r in found.results if r.continuation)
    assert best > 0.75
    kept = Scene.from_yaml(found.scene)
    assert [thing.object_type for thing in kept.objects].count("dynamic_body") == 1


def command(small, out, *more):
    return [
        *(sys.executable, "-m", "mpmworlds", "evaluate", "--predictor", "search"),
        *("--release", small.release, "--split", "train", "--out", out),
        *(a for k, v in OPTIONS.items() for a in ("--predictor-option", f"{k}={v}")),
        *more,
    ]


@pytest.mark.slow
def test_a_search_that_is_killed_in_a_sample_starts_it_again(small, tmp_path):
    scratch, out = tmp_path / "scratch", tmp_path / "killed"
    scratch.mkdir()
    killed = subprocess.Popen(
        [*map(str, command(small, out, "--workers", 1))],
        env=os.environ | {"TMPDIR": str(scratch)},
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 240
    while not list(scratch.glob("*/printed")) and time.monotonic() < deadline:
        assert killed.poll() is None  # it is not over before it has tried a scene
        time.sleep(0.02)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert (out / "results.jsonl").read_bytes() == b""
    shutil.rmtree(scratch)
    again = subprocess.run(
        [*map(str, command(small, out, "--workers", 1, "--json"))], capture_output=True
    )
    assert again.returncode == 0, again.stderr
    whole = evaluate(
        small.release, "search", "train", tmp_path / "whole", options=OPTIONS, workers=1
    )
    for name in ("results.jsonl", "scenes/s04.yaml"):
        assert (out / name).read_bytes() == (whole.parent / name).read_bytes()


@pytest.mark.slow
def test_processes_and_a_cluster_find_the_same(small, tmp_path):
    pytest.importorskip("ray", reason="Ray is not installed (the extra [cluster])")
    found = {}
    for name, how in (("processes", {"workers": 2}), ("ray", {"ray": "local"})):
        evaluate(
            *(small.release, "search", "test", tmp_path / name),
            options=OPTIONS,
            progress=False,
            **how,
        )
        _, found[name] = read_results(tmp_path / name / "results.jsonl")
    assert found["processes"] == found["ray"]
    assert found["ray"][0].sample_id == "p0000"
