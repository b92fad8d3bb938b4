"""Render the rows of a manifest into a store, on all cores, resumably.

What is in the store already is left alone, so an interrupted run goes on where it
stopped. A sample that fails is recorded with its reason and stops nothing else.
"""

import json
import multiprocessing
import os
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.builder.disk import disk_errors_named
from mpmworlds.builder.manifest import ManifestRow, text_sha256
from mpmworlds.builder.store import Store
from mpmworlds.sim.atomic import write_atomically
from mpmworlds.sim.link import link
from mpmworlds.sim.run import run
from mpmworlds.sim.scene import Scene


@dataclass(frozen=True)
class Job:
    """A program to render.

    Attributes
    ----------
    id
        Id of the sample.
    program
        The program text.
    framerate
        Frames per second of the video [1/s].
    """

    id: str
    program: str
    framerate: int


@dataclass(frozen=True)
class Failure:
    """A sample that was not rendered, and why."""

    id: str
    reason: str


@dataclass(frozen=True)
class Materialised:
    """How many samples were rendered, were there before, and failed."""

    rendered: int
    reused: int
    failures: tuple[Failure, ...]


def job_of(row: ManifestRow) -> Job:
    """Link the scene of a manifest row.

    Parameters
    ----------
    row
        The sample.

    Returns
    -------
    Job
        Its program.

    Raises
    ------
    ValueError
        If the linker writes another program than the manifest records.
    """
    scene = Scene.from_yaml(row.scene, source=row.id)
    program = link(scene)
    if text_sha256(program) != row.program_sha256:
        raise ValueError(
            f"{row.id}: the linked program's sha256 is {text_sha256(program)[:12]}..., "
            f"the manifest says {row.program_sha256[:12]}...; the manifest is from "
            "another version of mpmworlds: plan it again or use that version"
        )
    return Job(row.id, program, scene.output.framerate)


def materialise(
    rows: Iterable[ManifestRow], store: Store, failures_path: Path, workers: int = 0
) -> Materialised:
    """Render every row that the store lacks.

    Parameters
    ----------
    rows
        The samples.
    store
        Where the videos go.
    failures_path
        JSON Lines file of the samples that failed, {"id", "reason"} each; replaced.
    workers
        Number of processes, 0 for one per core.

    Returns
    -------
    Materialised
        Counts, and the failures sorted by id.

    Raises
    ------
    DiskFullError
        If the disk is full. Nothing half-written stays behind.
    ValueError
        If a manifest row does not link to the program that it records.
    """
    samples = list(rows)
    missing = [row for row in samples if store.get(row.program_sha256) is None]
    failures = render(map(job_of, missing), len(missing), store, failures_path, workers)
    return Materialised(
        rendered=len(missing) - len(failures),
        reused=len(samples) - len(missing),
        failures=tuple(failures),
    )


def render(
    jobs: Iterable[Job], total: int, store: Store, failures_path: Path, workers: int = 0
) -> list[Failure]:
    """Render programs that are linked already, whether they are in the store or not.

    Parameters
    ----------
    jobs
        The programs, taken one by one as processes become free.
    total
        How many there are, for the progress bar.
    store, failures_path, workers
        See ``materialise``.

    Returns
    -------
    list of Failure
        The samples that failed, sorted by id.
    """
    failures: list[Failure] = []
    failures_path.parent.mkdir(parents=True, exist_ok=True)
    _write_failures(failures_path, failures)
    with tqdm(total=total, desc="materialise", unit="sample") as bar:
        for job, reason in _outcomes(jobs, store, workers or os.cpu_count() or 1):
            if reason is not None:
                failures.append(Failure(job.id, reason))
                failures.sort(key=lambda failure: failure.id)
                _write_failures(failures_path, failures)
            bar.update()
    return failures


def _outcomes(
    jobs: Iterable[Job], store: Store, workers: int
) -> Iterator[tuple[Job, str | None]]:
    """Yield each job with None, or the reason of its failure."""
    queue = iter(jobs)
    # When a process is killed, e.g. for lack of memory, all jobs in flight are lost:
    # each is tried once more, alone, to tell the culprit from its victims.
    suspects: list[Job] = []
    running: dict[Future[str | None], Job] = {}
    pool = _pool(workers)
    try:
        while True:
            alone = bool(suspects)
            while len(running) < (1 if alone else 2 * workers):
                job = suspects.pop() if alone else next(queue, None)
                if job is None:
                    break
                running[pool.submit(_render, job, store)] = job
            if not running:
                return
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            if any(isinstance(f.exception(), BrokenProcessPool) for f in done):
                pool.shutdown()
                pool = _pool(workers)
                done = set(running)
            for future in done:
                job = running.pop(future)
                if not isinstance(future.exception(), BrokenProcessPool):
                    yield job, future.result()
                elif alone:
                    yield job, "its process was killed, perhaps for lack of memory"
                else:
                    suspects.append(job)
    finally:
        pool.shutdown(cancel_futures=True)


def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(
        workers, multiprocessing.get_context("spawn"), initializer=_one_thread
    )


def _one_thread() -> None:
    # One process per core: threads of the video decoder would only get in the way.
    os.environ["OPENCV_FFMPEG_THREADS"] = "1"


def _render(job: Job, store: Store) -> str | None:
    """Render one job in a worker; None, or the reason of its failure."""
    try:
        outcome = run(job.program)
        if outcome.status != "ok":
            return f"{outcome.status}: {outcome.message}"
        store.put(job.program, outcome.frames, job.framerate)
    except OSError:  # the machine's trouble, not the sample's
        raise
    except Exception as error:  # noqa: BLE001  # one sample must not stop the rest
        return f"{type(error).__name__}: {error}"
    return None


def _write_failures(path: Path, failures: Iterable[Failure]) -> None:
    lines = [json.dumps(asdict(failure)) + "\n" for failure in failures]
    with disk_errors_named(path):
        write_atomically(path, "".join(lines).encode())


def write_record(path: Path, rows: Iterable[ManifestRow], store: Store) -> None:
    """Record the hashes of rendered samples, one JSON line each, sorted by id.

    Parameters
    ----------
    path
        File to write.
    rows
        The samples.
    store
        Where they are.

    Raises
    ------
    LookupError
        If the store lacks a row.
    """
    lines = []
    for row in sorted(rows, key=lambda row: row.id):
        sample = store.get(row.program_sha256)
        if sample is None:
            raise LookupError(f"{row.id}: is not in {store.root}; materialise it first")
        line = {"id": row.id} | asdict(sample.description)
        lines.append(json.dumps(line, sort_keys=True) + "\n")
    write_atomically(path, "".join(lines).encode())
