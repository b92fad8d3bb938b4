"""Rendering resumes, survives what single samples do, and records why they failed."""

import json
import resource
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from mpmworlds.builder.manifest import text_sha256
from mpmworlds.builder.materialise import Job, job_of, materialise, render
from mpmworlds.builder.store import Store
from mpmworlds.sim.encode import decode_mp4
from mpmworlds.sim.link import link
from mpmworlds.sim.scene import Scene

RAISES = "def frames():\n    raise RuntimeError('no such pinwheel')\n    yield\n"
OFF_PALETTE = """
import numpy as np
def frames():
    yield np.full((8, 8, 3), (250, 10, 3), np.uint8)
"""
# Kills the worker process that waits for it, as the kernel does when memory runs out.
KILLS_WORKER = "import os, signal\nos.kill(os.getppid(), signal.SIGKILL)\n"


@pytest.fixture
def jobs(make_program):
    return [Job(f"p000{n}", make_program(n, size=16), 30) for n in range(3)]


def failures_in(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_all_samples_are_rendered(jobs, tmp_path, run_inline, capfd):
    store, log = Store(tmp_path / "store"), tmp_path / "log" / "failures.jsonl"
    assert render(jobs, 3, store, log, workers=2) == []
    for job in jobs:
        sample = store.get(text_sha256(job.program))
        np.testing.assert_array_equal(decode_mp4(sample.video), run_inline(job.program))
    assert failures_in(log) == []
    assert "3/3" in capfd.readouterr().err


def test_failures_are_recorded_with_reasons_and_stop_nothing_else(jobs, tmp_path):
    bad = [
        Job("p0011", RAISES, 30),
        Job("p0010", OFF_PALETTE, 30),
        Job("p0012", KILLS_WORKER, 30),
    ]
    log = tmp_path / "failures.jsonl"
    store = Store(tmp_path / "store")
    failures = render([*bad, *jobs], 6, store, log, workers=2)
    assert all(store.get(text_sha256(job.program)) for job in jobs)
    reasons = {failure.id: failure.reason for failure in failures}
    assert "exception: RuntimeError: no such pinwheel" in reasons["p0011"]
    assert "#FA0A03" in reasons["p0010"]
    assert "process was killed" in reasons["p0012"]
    assert failures_in(log) == [
        {"id": failure.id, "reason": failure.reason} for failure in failures
    ]
    assert list(reasons) == ["p0010", "p0011", "p0012"]


def test_old_failures_are_forgotten(jobs, tmp_path):
    log = tmp_path / "failures.jsonl"
    log.write_text('{"id": "p0000", "reason": "of another day"}\n')
    render(jobs[:1], 1, Store(tmp_path / "store"), log, workers=1)
    assert log.read_text() == ""


def test_a_full_disk_stops_with_a_clear_error(tmp_path, make_program):
    program = """
import signal, sys
from pathlib import Path
from mpmworlds.builder.materialise import Job, render
from mpmworlds.builder.store import Store
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
if __name__ == "__main__":
    jobs = [Job(str(n), open(sys.argv[1]).read() + f"# {n}", 30) for n in range(9)]
    out = Path(sys.argv[2])
    render(jobs, 9, Store(out / "store"), out / "failures.jsonl", workers=1)
"""
    (tmp_path / "main.py").write_text(program)
    (tmp_path / "program.py").write_text(make_program(0))
    done = subprocess.run(
        [sys.executable, "main.py", "program.py", str(tmp_path / "out")],
        cwd=tmp_path,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1500, 1500)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "DiskFullError" in done.stderr
    assert "what is finished is kept" in done.stderr
    left = [p.name for p in (tmp_path / "out").rglob("*") if p.is_file()]
    assert left == ["failures.jsonl"]


SCENE = """
schema: mpmworlds-scene/1
simulation: {grid_resolution: 32, time_step_dt: 1.0e-4, substeps_per_frame: 2,
             duration_frames: 3, particles_per_cell: 4, seed: 7}
objects:
- name: object_0
  object_type: dynamic_body
  shape: {type: box, center: [0.5, 0.5], size: [0.3, 0.3]}
  physics_properties: {constitutive_model: elastic, density: 1000.0,
                       youngs_modulus: 5.0e+4, poissons_ratio: 0.2}
  visualization: {color: '#F52D2C'}
output: {resolution: 64, framerate: 30}
"""


@pytest.fixture(scope="module")
def real_row(request):
    """A manifest row around a scene that the linker understands."""
    make_row = request.getfixturevalue("make_row")
    scene = Scene.from_yaml(SCENE)
    text = scene.to_yaml()
    row = make_row("p0000", "train", link(scene))
    return replace(row, scene=text, scene_sha256=text_sha256(text))


def test_rows_that_the_store_lacks_are_linked_and_rendered(real_row, tmp_path, corpus):
    store = Store(tmp_path / "store")
    there = corpus.rows[0]
    store.put(corpus.programs[there.id], corpus.frames[there.id], 30)
    rows = [there, real_row]
    done = materialise(rows, store, tmp_path / "failures.jsonl", workers=1)
    assert (done.rendered, done.reused, done.failures) == (1, 1, ())
    description = store.get(real_row.program_sha256).description
    assert (description.num_frames, description.framerate) == (3, 30)
    assert description.resolution == 64
    again = materialise(rows, store, tmp_path / "failures.jsonl", workers=1)
    assert (again.rendered, again.reused, again.failures) == (0, 2, ())


def test_a_row_of_another_linker_is_refused(real_row):
    with pytest.raises(ValueError, match="p0000: the linked program's sha256"):
        job_of(replace(real_row, program_sha256="0" * 64))
