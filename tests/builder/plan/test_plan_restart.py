"""What is finished of a plan is kept: families, and findings of trials."""

import multiprocessing
import os
import signal
import subprocess
import threading
import time

import pytest

from mpmworlds.builder.plan import plan
from mpmworlds.builder.plan.plan import write_plan
from mpmworlds.builder.plan.trials import read_journal, write_recorded
from mpmworlds.builder.render.executors import CutOffError
from tests.builder.plan.plans import LONG, ONE, TRIED, command, environment


@pytest.mark.slow
def test_a_plan_that_was_killed_goes_on_with_the_families_that_are_finished(
    tmp_path, monkeypatch
):
    path = tmp_path / "killed.parquet"
    parts = path.with_suffix(".parts")
    process = subprocess.Popen(
        command(path, "LONG", 1),
        env=environment(),
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    deadline = time.monotonic() + 120
    while len(list(parts.glob("*.json"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    finished = {p.name.partition("-")[0] for p in parts.glob("*.json")}
    assert 2 <= len(finished) < 6
    assert not path.exists()

    made, write = [], plan._write_part

    def note(part, family):
        made.append(family.rows[0].family_id)
        write(part, family)

    monkeypatch.setattr(plan, "_write_part", note)
    write_plan(LONG, path, workers=2)
    assert finished.isdisjoint(made)
    assert sorted(finished | set(made)) == sorted(map(str, LONG.roots()))
    assert not parts.exists()

    write_plan(LONG, tmp_path / "whole.parquet", workers=2)
    assert path.read_bytes() == (tmp_path / "whole.parquet").read_bytes()
    one, other = (tmp_path / f"{n}.rejected.json" for n in ("killed", "whole"))
    assert one.read_bytes() == other.read_bytes()


@pytest.fixture
def kills():
    """Return a function: kill the next `count` processes that are started here."""
    before = set(multiprocessing.active_children())
    threads = []

    def start(count):
        def kill():
            killed = set(before)
            deadline = time.monotonic() + 60
            while len(killed) < len(before) + count and time.monotonic() < deadline:
                for process in set(multiprocessing.active_children()) - killed:
                    os.kill(process.pid, signal.SIGKILL)
                    killed.add(process)
                time.sleep(0.02)

        threads.append(threading.Thread(target=kill))
        threads[-1].start()

    yield start
    for thread in threads:
        thread.join()


def test_what_a_killed_process_had_is_done_again(kills, tmp_path):
    whole, killed = (tmp_path / f"{name}.parquet" for name in ("whole", "killed"))
    write_plan(ONE, whole, workers=1)
    kills(1)
    write_plan(ONE, killed, workers=1)
    assert killed.read_bytes() == whole.read_bytes()


def test_work_at_which_every_process_is_killed_is_named(kills, tmp_path):
    kills(3)
    with pytest.raises(CutOffError, match="p0000: lost 3 times"):
        write_plan(ONE, tmp_path / "m.parquet", workers=1)
    assert not (tmp_path / "m.parquet").exists()


@pytest.mark.slow
def test_a_ray_cluster_plans_the_same_bytes(tmp_path):
    pytest.importorskip("ray")
    here, there = (tmp_path / f"{name}.parquet" for name in ("here", "there"))
    write_plan(ONE, here, workers=1)
    write_plan(ONE, there, workers=1, ray="local")
    assert there.read_bytes() == here.read_bytes()


# ---- trials


@pytest.mark.slow
def test_with_recorded_trials_a_plan_needs_none(tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))  # of the processes of the plan
    first, second = (tmp_path / name / "m.parquet" for name in ("first", "second"))
    planned = write_plan(TRIED, first, workers=1)
    assert {row.kind for row in planned.rows} == {"parent", "child", "perturbation"}
    assert len(planned.trials) >= 2
    assert read_journal(first.with_suffix(".trials.jsonl")) == planned.trials
    assert list(scratch.iterdir()) == []

    recorded = tmp_path / "trials.parquet"
    write_recorded(recorded, planned.trials)
    again = write_plan(TRIED, second, workers=1, trials=[recorded])
    assert again == planned
    assert first.read_bytes() == second.read_bytes()
    assert not second.with_suffix(".trials.jsonl").exists()
