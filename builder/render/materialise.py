"""Render the rows of a manifest into a store, resumably, on all cores or a cluster.

What is in the store already is left alone, so an interrupted run goes on where it
stopped. A sample that fails is recorded with its reason and stops nothing else. Several
runs may share a store: each renders what no other has rendered or is rendering.
"""

import json
import math
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import chain, count
from pathlib import Path
from typing import Final, Generic, Protocol, TypeVar

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.builder.plan.manifest import ManifestRow
from mpmworlds.builder.render.executors import Executor, Lost, open_executor
from mpmworlds.builder.render.render import Failed, Rendered, render_row
from mpmworlds.builder.render.store import Store, renderer
from mpmworlds.builder.render.timings import Timing, append_line, append_timing
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.locks import Hold, hold
from mpmworlds.files.posix import needed
from mpmworlds.files.targets import check_file, check_folder

FAILURES: Final = "failures.jsonl"
ATTEMPTS: Final = 3  # starts of a sample whose process is killed
POLL: Final = 0.5  # seconds between looks at what another run is rendering


class Renderable(Protocol):
    """What is rendered: a manifest row, or a program that is linked already."""

    @property
    def id(self) -> str:
        """Id of the sample."""

    @property
    def program_sha256(self) -> str:
        """SHA-256 of its program text."""


T = TypeVar("T", bound=Renderable)


@dataclass(frozen=True)
class Failure:
    """A sample that was not rendered.

    Attributes
    ----------
    id
        Which.
    kind
        Kind of failure, e.g. ``crash``, ``lost`` or ``ColorError``.
    reason
        What happened, in words.
    attempts
        How often it was tried.
    """

    id: str
    kind: str
    reason: str
    attempts: int = 1


@dataclass(frozen=True)
class Materialised:
    """What became of the samples.

    Attributes
    ----------
    rendered, reused
        How many were rendered, and were there before or come from another run.
    failures
        The others, sorted by id.
    simulation_seconds, encoding_seconds
        Wall time of the rendered samples, summed over all processes [s].
    seconds
        Wall time of everything [s].
    bytes
        Size of the rendered videos.
    """

    rendered: int
    reused: int
    failures: tuple[Failure, ...]
    simulation_seconds: float = 0.0
    encoding_seconds: float = 0.0
    seconds: float = 0.0
    bytes: int = 0

    def failures_by_kind(self) -> dict[str, list[Failure]]:
        """Group the failures, the most frequent kind first."""
        counted = Counter(failure.kind for failure in self.failures)
        return {
            kind: [failure for failure in self.failures if failure.kind == kind]
            for kind, _ in counted.most_common()
        }

    def summary(self) -> dict[str, object]:
        """All of it for a program to read, with failures counted by kind."""
        kinds = {kind: len(found) for kind, found in self.failures_by_kind().items()}
        return asdict(self) | {"failed": len(self.failures), "failures": kinds}


def materialise(
    tasks: Sequence[T],
    store: Store,
    failures_path: Path,
    executor: Executor[T, Rendered | Failed | Lost],
) -> Materialised:
    """Render every sample that the store lacks.

    Parameters
    ----------
    tasks
        The samples, with different ids.
    store
        Where the videos go.
    failures_path
        JSON Lines file of the samples that failed, {"id", "kind", "reason",
        "attempts"} each;
        replaced, appended to as they fail, sorted at the end.
    executor
        What renders a task: ``open_executor(render_row)``.

    Returns
    -------
    Materialised
        Counts, seconds and failures.

    Raises
    ------
    DiskFullError
        If the disk is full. Nothing half-written stays behind.
    ValueError
        If a manifest row does not link to the program that it records.
    """
    start = time.monotonic()
    reused, timings, failures = 0, list[Timing](), list[Failure]()
    store.sweep()
    _write_failures(failures_path, failures)
    with tqdm(total=len(tasks), desc="materialise", unit="sample") as bar:
        for found in _Run(store, executor).outcomes(tasks):
            if isinstance(found, Timing):
                timings.append(found)
            elif isinstance(found, Failure):
                failures.append(found)
                append_line(failures_path, _line(found))
            else:
                reused += 1
            bar.update()
    failures.sort(key=lambda failure: failure.id)
    _write_failures(failures_path, failures)
    return Materialised(
        rendered=len(timings),
        reused=reused,
        failures=tuple(failures),
        simulation_seconds=sum(t.simulation_seconds for t in timings),
        encoding_seconds=sum(t.encoding_seconds for t in timings),
        seconds=time.monotonic() - start,
        bytes=sum(t.bytes for t in timings),
    )


def render_rows(
    rows: Sequence[ManifestRow],
    store: Store,
    *,
    workers: int = 0,
    ray: str | None = None,
    failures: Path | None = None,
) -> tuple[Materialised, Path]:
    """Render rows of a manifest that the store lacks.

    Parameters
    ----------
    rows, store
        What, and where to.
    workers, ray
        Where the work is done, see `mpmworlds.builder.render.executors.open_executor`.
    failures
        File of the samples that failed; by default one in the store that no other run
        writes to.

    Returns
    -------
    Materialised
        What became of them.
    Path
        The file of the failures.

    Raises
    ------
    ValueError
        If another run writes to the file that is named; see `materialise` for others.
    OSError
        If the store or the file of the failures cannot be written.
    """
    check_folder(store.root)
    check_file(failures)
    with (
        failures_file(store.root, failures) as path,
        open_executor(render_row, workers, ray) as executor,
    ):
        return materialise(rows, store, path, executor), path


@contextmanager
def failures_file(folder: Path, named: Path | None = None) -> Iterator[Path]:
    """A file that no other run writes its failures to; raises `ValueError`."""
    numbered = (folder / f"failures-{number}.jsonl" for number in count(2))
    for path in (named,) if named else chain((folder / FAILURES,), numbered):
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = hold(path.with_name(f".{path.name}.lock"))
        if lock is not None:
            with lock:
                yield path
            return
    raise ValueError(f"--failures {named}: another run writes it; name another file")


class _Reused:
    """There is a sample in the store."""


class _Run(Generic[T]):
    """One run over tasks, with at most as many in flight as the executor has slots."""

    def __init__(
        self, store: Store, executor: Executor[T, Rendered | Failed | Lost]
    ) -> None:
        self._store = store
        self._executor = executor
        # Every claim is an open file, and a process may have only so many.
        resource = needed("resource")
        files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        self._most = math.inf if files == resource.RLIM_INFINITY else files // 2
        self._claims: dict[str, Hold] = {}  # of the tasks in flight, by id
        self._elsewhere: list[T] = []  # what another run has claimed
        self._attempts: Counter[str] = Counter()

    def outcomes(self, tasks: Iterable[T]) -> Iterator[_Reused | Timing | Failure]:
        """Yield what becomes of each task, in any order."""
        try:
            yield from self._start(tasks)
            while self._elsewhere or self._claims:
                again, self._elsewhere = self._elsewhere, []
                yield from self._start(again)
                yield from self._end(POLL if self._elsewhere else None)
        finally:
            for claim in self._claims.values():
                claim.close()

    def _start(self, tasks: Iterable[T]) -> Iterator[_Reused | Timing | Failure]:
        """Start tasks as there is room, but for those that are done or claimed."""
        for task in tasks:
            claim = self._store.claim(task.program_sha256)
            if claim is None:
                self._elsewhere.append(task)
                continue
            self._claims[task.id] = claim
            if self._store.get(task.program_sha256):
                self._claims.pop(task.id).close()
                yield _Reused()
                continue
            self._submit(task)
            full = len(self._claims) >= min(self._executor.slots, self._most)
            yield from self._end(None if full else 0)

    def _submit(self, task: T) -> None:
        self._attempts[task.id] += 1
        self._executor.submit(task)

    def _end(self, timeout: float | None) -> Iterator[Timing | Failure]:
        """Keep what has ended; what was lost starts again a few times."""
        for task, result in self._executor.wait(timeout):
            attempts = self._attempts[task.id]
            if isinstance(result, Lost) and attempts < ATTEMPTS:
                self._submit(task)
                continue
            if isinstance(result, Rendered):
                outcome: Timing | Failure = self._keep(task, result)
            elif isinstance(result, Lost):
                outcome = Failure(task.id, "lost", result.reason, attempts)
            else:
                outcome = Failure(task.id, result.kind, result.reason, attempts)
            self._claims.pop(task.id).close()
            yield outcome

    def _keep(self, task: T, result: Rendered) -> Timing:
        if result.renderer != renderer():
            raise ValueError(
                f"{task.id}: rendered by {result.renderer}, this machine has "
                f"{renderer()}; install the same versions on all machines"
            )
        self._store.add(result.sample)
        timing = Timing(
            id=task.id,
            program_sha256=task.program_sha256,
            simulation_seconds=round(result.simulation_seconds, 3),
            encoding_seconds=round(result.encoding_seconds, 3),
            bytes=len(result.sample.video) + len(result.sample.clip),
        )
        append_timing(self._store.root, timing)
        return timing


def _line(failure: Failure) -> str:
    return json.dumps(asdict(failure)) + "\n"


def _write_failures(path: Path, failures: Iterable[Failure]) -> None:
    write_atomically(path, "".join(map(_line, failures)).encode())


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
