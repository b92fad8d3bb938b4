"""Both executors carry out what they are given and outlive what it does to them."""

import os
import sys
import time

import pytest

from mpmworlds.builder.render.executors import Cluster, Lost, Processes, open_executor
from mpmworlds.builder.render.materialise import ATTEMPTS, materialise
from mpmworlds.builder.render.render import Job, render_job
from mpmworlds.builder.render.store import Store

# Kills the worker process that waits for it, as the kernel does when memory runs out.
KILLS_WORKER = "import os, signal\nos.kill(os.getppid(), signal.SIGKILL)\n"


def carry_out(executor, tasks):
    """Return the results by task."""
    results, tasks = {}, list(tasks)
    flight = 0
    while tasks or flight:
        while tasks and flight < executor.slots:
            executor.submit(tasks.pop(0))
            flight += 1
        ended = executor.wait(None)
        flight -= len(ended)
        results |= dict(ended)
    return results


@pytest.fixture
def processes():
    with Processes(eval, 2) as executor:
        yield executor


def test_every_task_has_its_result(processes):
    tasks = [f"{n} ** 2" for n in range(7)]
    assert carry_out(processes, tasks) == {f"{n} ** 2": n * n for n in range(7)}


def test_processes_are_reused_and_as_many_as_there_are_slots(processes):
    tasks = [f"__import__('os').getpid() + 0 * {n}" for n in range(9)]
    workers = set(carry_out(processes, tasks).values())
    assert 1 <= len(workers) <= processes.slots == 2
    assert os.getpid() not in workers


@pytest.mark.parametrize(
    ("end", "reason"),
    [
        ("__import__('os')._exit(3)", "its process left with exit code 3"),
        ("__import__('os').kill(__import__('os').getpid(), 9)", "killed by SIGKILL"),
    ],
)
def test_a_dying_process_takes_only_its_own_task_along(end, reason, processes):
    results = carry_out(processes, ["1", end, "2", "3"])
    lost = results.pop(end)
    assert isinstance(lost, Lost)
    assert reason in lost.reason
    assert results == {"1": 1, "2": 2, "3": 3}


def test_what_the_function_raises_is_raised_by_wait(processes):
    processes.submit("1 / 0")
    with pytest.raises(ZeroDivisionError):
        processes.wait(None)
    assert carry_out(processes, ["5"]) == {"5": 5}


def test_waiting_ends_at_its_time_limit(processes):
    start = time.monotonic()
    assert processes.wait(0.1) == []
    processes.submit("__import__('time').sleep(600)")
    assert processes.wait(0.1) == []
    assert 0.2 <= time.monotonic() - start < 30


def test_closing_ends_tasks_that_are_at_work(processes):
    processes.submit("__import__('time').sleep(600)")
    (worker,) = [worker for worker, _ in processes._busy.values()]
    processes.close()
    assert worker.process.exitcode is not None


def test_no_process_is_started_before_there_is_a_task(processes):
    assert processes.wait(0) == []
    assert processes._idle == []


def test_a_negative_number_of_workers_is_refused():
    with pytest.raises(ValueError, match="workers = -1, must be >= 0"):
        open_executor(eval, -1)


def test_by_default_there_is_a_process_per_core():
    with open_executor(eval) as executor:
        assert executor.slots == os.cpu_count()


def test_without_ray_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(RuntimeError, match=r"pip install 'mpmworlds\[cluster\]'"):
        open_executor(eval, ray="local")


# ---- Ray


@pytest.fixture(scope="module")
def cluster():
    """Start a cluster of two cores that carries out expressions and jobs."""
    pytest.importorskip("ray", reason="Ray is not installed (the extra [cluster])")

    def act(task):
        return render_job(task) if isinstance(task, Job) else eval(task)

    with Cluster(act, "local", 2) as executor:
        yield executor


@pytest.mark.slow
def test_a_cluster_gives_every_task_its_result(cluster):
    assert carry_out(cluster, ["1 + 1", "2 + 2", "3"]) == {
        "1 + 1": 2,
        "2 + 2": 4,
        "3": 3,
    }
    assert cluster.wait(0) == []


@pytest.mark.slow
def test_a_cluster_tells_lost_tasks_from_wrong_ones(cluster):
    fatal, full = "__import__('os')._exit(3)", "open('/absent/file')"
    results = carry_out(cluster, [fatal, full, "7"])
    assert results["7"] == 7
    assert "lost by Ray" in results[fatal].reason
    assert "FileNotFoundError" in results[full].reason
    cluster.submit("1 / 0")
    with pytest.raises(ZeroDivisionError):
        cluster.wait(None)


@pytest.mark.slow
def test_a_sample_that_kills_workers_of_a_cluster_fails_alone(
    cluster, make_program, tmp_path
):
    jobs = [Job(f"p000{n}", make_program(n, size=16), 30) for n in range(2)]
    store, log = Store(tmp_path / "store"), tmp_path / "failures.jsonl"
    done = materialise([Job("p0009", KILLS_WORKER, 30), *jobs], store, log, cluster)
    (failure,) = done.failures
    assert (failure.id, failure.kind, failure.attempts) == ("p0009", "lost", ATTEMPTS)
    assert done.rendered == 2
    assert all(store.get(job.program_sha256) for job in jobs)
