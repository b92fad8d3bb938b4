"""Rendering resumes, survives what single samples do, and records why they failed."""

import json
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from mpmworlds.builder.plan.manifest import text_sha256, write_manifest
from mpmworlds.builder.render.executors import Executor, Lost, Processes
from mpmworlds.builder.render.materialise import ATTEMPTS, materialise
from mpmworlds.builder.render.render import Job, render_job, render_row
from mpmworlds.builder.render.store import Store
from mpmworlds.builder.render.timings import read_timings
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.scene.scene import Scene

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


def render(jobs, store, log, workers=1):
    with Processes(render_job, workers) as executor:
        return materialise(jobs, store, log, executor)


def hidden_below(folder):
    return [path for path in folder.rglob("*") if path.name.startswith(".")]


def test_all_samples_are_rendered(jobs, tmp_path, run_inline, capfd):
    store, log = Store(tmp_path / "store"), tmp_path / "log" / "failures.jsonl"
    done = render(jobs, store, log, workers=2)
    assert (done.rendered, done.reused, done.failures) == (3, 0, ())
    for job in jobs:
        sample = store.get(text_sha256(job.program))
        np.testing.assert_array_equal(decode_mp4(sample.video), run_inline(job.program))
    assert failures_in(log) == []
    assert "3/3" in capfd.readouterr().err
    assert hidden_below(tmp_path) == []


def test_failures_are_recorded_with_reasons_and_stop_nothing_else(jobs, tmp_path):
    bad = [
        Job("p0011", RAISES, 30),
        Job("p0010", OFF_PALETTE, 30),
        Job("p0012", KILLS_WORKER, 30),
    ]
    log = tmp_path / "failures.jsonl"
    store = Store(tmp_path / "store")
    done = render([*bad, *jobs], store, log, workers=2)
    assert all(store.get(text_sha256(job.program)) for job in jobs)
    failures = {failure.id: failure for failure in done.failures}
    assert list(failures) == ["p0010", "p0011", "p0012"]
    assert failures["p0011"].kind == "exception"
    assert "RuntimeError: no such pinwheel" in failures["p0011"].reason
    assert "#FA0A03" in failures["p0010"].reason
    assert "killed by SIGKILL" in failures["p0012"].reason
    assert [f.attempts for f in done.failures] == [1, 1, ATTEMPTS]
    assert failures_in(log) == [asdict(failure) for failure in done.failures]
    assert done.summary()["failures"] == {"ColorError": 1, "exception": 1, "lost": 1}
    assert (done.summary()["failed"], done.rendered) == (3, 3)
    assert hidden_below(tmp_path) == []


def test_a_program_that_was_killed_is_run_again(jobs, make_program, tmp_path):
    note = tmp_path / "killed"
    once = (
        f"import os, signal\nif not os.path.exists({str(note)!r}):\n"
        f"    open({str(note)!r}, 'w').close()\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    always = "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n"
    tasks = [
        Job("p0010", once + make_program(3, size=16), 30),
        Job("p0011", always, 30),
    ]
    done = render(tasks, Store(tmp_path / "store"), tmp_path / "log.jsonl")
    assert (done.rendered, len(done.failures)) == (1, 1)
    assert (done.failures[0].id, done.failures[0].attempts) == ("p0011", ATTEMPTS)
    assert done.failures[0].kind == "lost"
    assert "its program was killed" in done.failures[0].reason


def test_old_failures_are_forgotten(jobs, tmp_path):
    log = tmp_path / "failures.jsonl"
    log.write_text('{"id": "p0000", "reason": "of another day"}\n')
    render(jobs[:1], Store(tmp_path / "store"), log)
    assert log.read_text() == ""


def test_what_rendering_took_is_logged_and_summed(jobs, tmp_path):
    store = Store(tmp_path / "store")
    done = render(jobs, store, tmp_path / "failures.jsonl")
    timings = read_timings(store.root)
    assert sorted(t.id for t in timings) == [job.id for job in jobs]
    for timing in timings:
        sample = store.get(timing.program_sha256)
        assert timing.bytes == len(sample.video) + len(sample.clip)
        assert 0 < timing.simulation_seconds < done.seconds
    assert done.bytes == sum(t.bytes for t in timings)
    assert done.simulation_seconds == sum(t.simulation_seconds for t in timings)
    again = render(jobs, store, tmp_path / "failures.jsonl")
    assert (again.reused, again.bytes, again.simulation_seconds) == (3, 0, 0)
    assert read_timings(store.root) == timings


def test_rows_with_one_program_are_rendered_once(jobs, tmp_path):
    twins = [jobs[0], replace(jobs[0], id="p0009")]
    done = render(twins, Store(tmp_path / "store"), tmp_path / "f.jsonl", workers=2)
    assert (done.rendered, done.reused) == (1, 1)


def test_a_corrupt_sample_is_rendered_again(jobs, tmp_path, caplog):
    store = Store(tmp_path / "store")
    render(jobs, store, tmp_path / "failures.jsonl")
    video = sorted(store.root.rglob("*.mp4"))[0]
    video.write_bytes(video.read_bytes()[:-9])
    done = render(jobs, store, tmp_path / "failures.jsonl")
    assert (done.rendered, done.reused) == (1, 2)
    assert caplog.text.count("it will be rendered again") == 1
    assert all(store.get(job.program_sha256) for job in jobs)


class Unlucky(Executor):
    """Loses the first results of each task, and does the work right here."""

    slots = 1

    def __init__(self, losses):
        self.losses, self.starts, self.task = losses, Counter(), None

    def submit(self, task):
        self.starts[task.id] += 1
        self.task = task

    def wait(self, timeout):
        task, self.task = self.task, None
        if task is None:
            return []
        if self.starts[task.id] <= self.losses:
            return [(task, Lost("its machine is gone"))]
        return [(task, render_job(task))]

    def close(self):
        """Leave nothing behind: there is no process."""


@pytest.mark.parametrize("losses", [ATTEMPTS - 1, ATTEMPTS])
def test_what_is_lost_is_tried_again_a_few_times(losses, jobs, tmp_path):
    executor = Unlucky(losses)
    done = materialise(
        jobs[:1], Store(tmp_path / "store"), tmp_path / "failures.jsonl", executor
    )
    assert executor.starts == {"p0000": ATTEMPTS}
    assert done.rendered == (losses < ATTEMPTS)
    assert [(f.kind, f.reason, f.attempts) for f in done.failures] == (
        [("lost", "its machine is gone", ATTEMPTS)] if losses == ATTEMPTS else []
    )


def test_other_versions_on_another_machine_are_refused(jobs, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "mpmworlds.builder.render.render.renderer", lambda: "h265, taichi 0"
    )
    store = Store(tmp_path / "store")
    with pytest.raises(ValueError, match="p0000: rendered by h265, taichi 0, this mac"):
        materialise(jobs, store, tmp_path / "failures.jsonl", Unlucky(0))
    assert not store.has(jobs[0].program_sha256)
    assert hidden_below(tmp_path) == []


# ---- several processes, and the end of them

RUN = """
import json, signal, sys
from pathlib import Path
from mpmworlds.builder.render.executors import Processes
from mpmworlds.builder.render.materialise import materialise
from mpmworlds.builder.render.render import Job, render_job
from mpmworlds.builder.render.store import Store
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
root = Path(sys.argv[1])
jobs = [Job(**job) for job in json.loads((root / "jobs.json").read_text())]
with Processes(render_job, 2) as executor:
    done = materialise(jobs, Store(root / "store"), root / sys.argv[2], executor)
print(json.dumps(done.summary()))
"""


def start(root, jobs, failures="failures.jsonl", **options):
    """Start a run in a process of its own."""
    root.mkdir(exist_ok=True)
    (root / "jobs.json").write_text(json.dumps([asdict(job) for job in jobs]))
    return subprocess.Popen(
        [sys.executable, "-c", RUN, str(root), failures],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def telling(job, path, seconds):
    """Return the job with a program that tells its processes and takes its time."""
    head = f"""
import os, time
with open({str(path)!r}, "a") as tale:
    tale.write("{job.id} %d %d\\n" % (os.getpid(), os.getppid()))
time.sleep({seconds})
"""
    return replace(job, program=head + job.program)


def wait_until(holds, seconds=60):
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline, "it never came true"
        time.sleep(0.01)


def is_alive(process):
    """Say whether a process runs; one that is dead but not yet reaped does not."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2][1] != "Z"
    except FileNotFoundError:
        return False


def test_two_runs_share_the_work_on_one_store(make_program, tmp_path):
    tale = tmp_path / "tale"
    jobs = [Job(f"p000{n}", make_program(n, size=16), 30) for n in range(6)]
    jobs = [telling(job, tale, 0.3) for job in jobs]
    runs = [start(tmp_path, jobs, f"failures-{n}.jsonl") for n in range(2)]
    done = [json.loads(run.communicate()[0]) for run in runs]
    assert sorted(line.split()[0] for line in tale.read_text().splitlines()) == [
        job.id for job in jobs
    ]
    assert sum(summary["rendered"] for summary in done) == 6
    assert [s["rendered"] + s["reused"] for s in done] == [6, 6]
    assert hidden_below(tmp_path) == []


def test_a_run_takes_over_what_another_had_claimed_when_it_was_killed(jobs, tmp_path):
    tale = tmp_path / "tale"
    jobs = [telling(job, tale, 0.5) for job in jobs]
    first = start(tmp_path, jobs)
    wait_until(lambda: tale.exists())
    second = start(tmp_path, jobs, "others.jsonl")
    first.kill()
    first.communicate()
    done = json.loads(second.communicate()[0])
    assert done["rendered"] + done["reused"] == 3
    assert hidden_below(tmp_path) == []


def test_nothing_outlives_a_run_that_is_killed(jobs, tmp_path):
    tale = tmp_path / "tale"
    run = start(tmp_path, [telling(job, tale, 600) for job in jobs])
    wait_until(lambda: tale.exists() and tale.read_text().count("\n") == 2)
    lines = tale.read_text().splitlines()
    processes = [int(number) for line in lines for number in line.split()[1:]]
    assert all(map(is_alive, processes))
    run.kill()
    run.communicate()
    wait_until(lambda: not any(map(is_alive, processes)))


@pytest.mark.parametrize("finished", [0, 2])
def test_after_kill_9_the_same_command_gives_the_same_store(
    finished, make_program, tmp_path
):
    jobs = [Job(f"p000{n}", make_program(n), 30) for n in range(5)]
    interrupted, whole = tmp_path / "interrupted", tmp_path / "whole"
    run = start(interrupted, jobs)
    wait_until(lambda: interrupted.joinpath("store").exists())
    wait_until(lambda: len(list(interrupted.rglob("*.json"))) > finished)
    run.kill()
    run.communicate()
    done = json.loads(start(interrupted, jobs).communicate()[0])
    assert (done["rendered"] + done["reused"], done["failed"]) == (5, 0)
    materialise(jobs, Store(whole / "store"), whole / "failures.jsonl", Unlucky(0))
    assert entries(interrupted) == entries(whole)
    assert hidden_below(tmp_path) == []


def entries(root):
    """Return the files of the entries of a store, which the log does not belong to."""
    found = (root / "store").glob("??/*")
    return {path.relative_to(root): path.read_bytes() for path in found}


def test_a_full_disk_stops_with_a_clear_error(tmp_path, make_program):
    jobs = [Job(str(n), make_program(0) + f"# {n}", 30) for n in range(9)]
    run = start(
        tmp_path,
        jobs,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1500, 1500)),
    )
    _, err = run.communicate()
    assert run.returncode == 1
    assert "DiskFullError" in err
    assert "what is finished is kept" in err
    left = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"failures.jsonl", "jobs.json"}


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
    store, log = Store(tmp_path / "store"), tmp_path / "failures.jsonl"
    there = corpus.rows[0]
    store.put(corpus.programs[there.id], corpus.frames[there.id], 30)
    rows = [there, real_row]
    with Processes(render_row, 1) as executor:
        done = materialise(rows, store, log, executor)
        assert (done.rendered, done.reused, done.failures) == (1, 1, ())
        description = store.get(real_row.program_sha256).description
        assert (description.num_frames, description.framerate) == (3, 30)
        assert description.resolution == 64
        again = materialise(rows, store, log, executor)
        assert (again.rendered, again.reused, again.failures) == (0, 2, ())


def test_a_row_of_another_linker_stops_the_run(real_row, tmp_path):
    store = Store(tmp_path / "store")
    row = replace(real_row, program_sha256="0" * 64)
    with (
        Processes(render_row, 1) as executor,
        pytest.raises(ValueError, match="p0000: the linked program's sha256"),
    ):
        materialise([row], store, tmp_path / "failures.jsonl", executor)
    assert hidden_below(tmp_path) == []


@pytest.mark.slow
def test_a_killed_command_goes_on_with_simulated_scenes(real_row, tmp_path):
    rows = [real_row]
    for seed in (8, 9):
        scene = Scene.from_yaml(SCENE.replace("seed: 7", f"seed: {seed}"))
        text, program = scene.to_yaml(), text_sha256(link(scene))
        row = replace(real_row, id=f"p000{seed}", scene=text, program_sha256=program)
        rows.append(replace(row, scene_sha256=text_sha256(text)))
    store, path = Store(tmp_path / "store"), tmp_path / "manifest.parquet"
    write_manifest(path, rows)
    command = [sys.executable, "-m", "mpmworlds", "materialise", "--manifest", path]
    command += ["--store", store.root, "--workers", "2", "--json"]
    run = subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE)
    wait_until(lambda: any(store.root.rglob("*.json")))
    run.send_signal(signal.SIGKILL)
    run.communicate()
    kept = [row for row in rows if store.get(row.program_sha256)]
    assert 1 <= len(kept) < 3
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout)["reused"] == len(kept)
    assert all(store.get(row.program_sha256) for row in rows)
    assert hidden_below(tmp_path) == []
