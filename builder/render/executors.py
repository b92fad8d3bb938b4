"""Where work is done: processes of this machine, or a Ray cluster.

Both carry out a function for one task after another, each time in a process that may be
killed without harm to the rest, and bring back what it returns. Who uses one need not
know which it is.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from multiprocessing.process import BaseProcess
from typing import Any, Final, Generic, TypeVar

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.files.closeable import Closeable

T = TypeVar("T")
R = TypeVar("R")

PER_CPU: Final = 2  # tasks in flight per core of a cluster: one runs, one is on its way
PATIENCE: Final = 10.0  # seconds for a process to clean up after itself
ATTEMPTS: Final = 3  # at a task whose process is lost


class CutOffError(RuntimeError):
    """Processes were killed again and again."""


@dataclass(frozen=True)
class Lost:
    """There is no result, because the process or its machine died; and how."""

    reason: str


class Executor(Closeable, Generic[T, R]):
    """Carries out a function; a context, at whose end all its processes end."""

    @property
    @abstractmethod
    def slots(self) -> int:
        """How many tasks may be in flight."""

    @abstractmethod
    def submit(self, task: T) -> None:
        """Start a task; only if fewer than ``slots`` are in flight."""

    @abstractmethod
    def wait(self, timeout: float | None) -> list[tuple[T, R | Lost]]:
        """Return some tasks that have ended, and their results.

        Parameters
        ----------
        timeout
            Longest time to wait for the first [s]; None to wait until there is one.

        Raises
        ------
        Exception
            What the function raised for one of them.
        """

    @abstractmethod
    def close(self) -> None:
        """End all processes, also those at work."""


def open_executor(
    function: Callable[[T], R], workers: int = 0, ray: str | None = None
) -> Executor[T, R]:
    """Choose an executor.

    Parameters
    ----------
    function
        What to carry out: a module's function, of tasks and with results that pickle.
    workers
        Number of tasks at a time, 0 for as many as there are cores.
    ray
        Address of a Ray cluster, see ``Cluster``; None for processes of this machine.
    """
    if workers < 0:
        raise ValueError(f"workers = {workers}, must be >= 0 (0: one per core)")
    if ray is None:
        return Processes(function, workers or os.cpu_count() or 1)
    return Cluster(function, ray, workers)


def carry_out_all(
    executor: Executor[T, R], tasks: Iterable[T], name: Callable[[T], str]
) -> Iterator[tuple[T, R]]:
    """Carry out tasks, those of a lost process anew.

    Parameters
    ----------
    executor
        What carries them out.
    tasks
        Tasks, started in order.
    name
        What to call a task in an error.

    Yields
    ------
    task, result
        As they are done.

    Raises
    ------
    CutOffError
        If the process of a task was lost again and again.
    """
    queue, flying = list(tasks)[::-1], 0
    losses: Counter[int] = Counter()  # by identity: a task comes back as it was given
    while queue or flying:
        while queue and flying < executor.slots:
            executor.submit(queue.pop())
            flying += 1
        for task, result in executor.wait(None):
            flying -= 1
            if not isinstance(result, Lost):
                yield task, result
                continue
            losses[id(task)] += 1
            if losses[id(task)] == ATTEMPTS:
                raise CutOffError(
                    f"{name(task)}: lost {ATTEMPTS} times ({result.reason}); run the "
                    "command again, what is finished is kept"
                )
            queue.append(task)


def results_of(
    function: Callable[[T], R],
    tasks: Sequence[T],
    name: Callable[[T], str],
    *,
    workers: int,
    desc: str,
    unit: str,
) -> list[R]:
    """Carry out a function here, or in processes, behind a progress bar.

    Parameters
    ----------
    function
        A function at the top of a module.
    tasks
        What to call it with.
    name
        Name of a task, different for each.
    workers
        Number of processes: 1 for this one alone, 0 for one per core.
    desc, unit
        What the progress bar says.

    Returns
    -------
    list
        The results, in the order of the tasks.

    Raises
    ------
    CutOffError
        If the process of a task was lost again and again.
    """
    results: dict[str, R] = {}
    with tqdm(total=len(tasks), desc=desc, unit=unit) as bar:
        for task, result in _done(function, tasks, name, workers):
            results[name(task)] = result
            bar.update()
    return [results[name(task)] for task in tasks]


def _done(
    function: Callable[[T], R],
    tasks: Sequence[T],
    name: Callable[[T], str],
    workers: int,
) -> Iterator[tuple[T, R]]:
    if workers == 1:
        yield from ((task, function(task)) for task in tasks)
        return
    with open_executor(function, workers) as executor:
        yield from carry_out_all(executor, tasks, name)


@dataclass(frozen=True)
class _Worker:
    process: BaseProcess
    connection: "Connection[Any, Any]"


class Processes(Executor[T, R]):
    """Processes of this machine, started as they are needed, one task each at a time.

    Parameters
    ----------
    function
        See ``open_executor``.
    count
        Number of processes.
    """

    def __init__(self, function: Callable[[T], R], count: int) -> None:
        self._function = function
        self._count = count
        self._idle: list[_Worker] = []
        self._busy: dict[Any, tuple[_Worker, T]] = {}  # by connection

    @property
    def slots(self) -> int:
        """How many tasks may be in flight."""
        return self._count

    def submit(self, task: T) -> None:
        """Start a task."""
        worker = self._idle.pop() if self._idle else self._start()
        self._busy[worker.connection] = worker, task
        with suppress(OSError):  # it died while idle: `wait` will find its task lost
            worker.connection.send(task)

    def _start(self) -> _Worker:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, self._function))
        process.daemon = True
        process.start()
        theirs.close()  # so that ours ends when the process does
        return _Worker(process, ours)

    def wait(self, timeout: float | None) -> list[tuple[T, R | Lost]]:
        """Return some tasks that have ended."""
        if not self._busy:
            time.sleep(timeout or 0)
        ended: list[tuple[T, R | Lost]] = []
        for connection in wait_for(list(self._busy), timeout) if self._busy else []:
            worker, task = self._busy.pop(connection)
            try:
                result, error = worker.connection.recv()
            except (EOFError, OSError):
                ended.append((task, Lost(_bury(worker))))
                continue
            self._idle.append(worker)
            if error is not None:
                raise error
            ended.append((task, result))
        return ended

    def close(self) -> None:
        """End all processes."""
        workers = self._idle + [worker for worker, _ in self._busy.values()]
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            _bury(worker)
        self._idle, self._busy = [], {}


def _bury(worker: _Worker) -> str:
    """End a process for certain, and say how it ended."""
    worker.connection.close()
    worker.process.join(PATIENCE)
    worker.process.kill()
    worker.process.join()
    code = worker.process.exitcode or 0
    if code < 0:
        how = f"was killed by {signal.Signals(-code).name}, perhaps for lack of memory"
    else:
        how = f"left with exit code {code}"
    return f"its process {how}"


def _serve(connection: "Connection[Any, Any]", function: Callable[[Any], Any]) -> None:
    """Carry out tasks until the other end of the connection closes."""
    for asked in (signal.SIGINT, signal.SIGHUP):  # of all: the parent decides
        signal.signal(asked, signal.SIG_IGN)
    # As an exception, so that programs and scratch folders are cleaned up.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            task = connection.recv()
        except EOFError:
            return
        try:
            result, error = function(task), None
        except Exception as raised:  # noqa: BLE001  # raised again by the parent
            result, error = None, raised
        connection.send((result, error))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)


class Cluster(Executor[T, R]):
    """A Ray cluster.

    Every machine of it needs the same version of this package. Nothing but tasks and
    results travels, so that they need share no folder.

    Parameters
    ----------
    function
        See ``open_executor``.
    address
        'local' starts a cluster on this machine, 'auto' joins the one that this machine
        is part of, host:port that of another.
    limit
        Number of tasks in flight, and of cores of a cluster that is started here; 0 for
        a few per core, and all cores.
    """

    def __init__(self, function: Callable[[T], R], address: str, limit: int) -> None:
        self._limit = limit
        self._ray = _import_ray()
        alone = {"num_cpus": limit or None, "include_dashboard": False}
        options = alone if address == "local" else {}
        self._ray.init(address=address, log_to_driver=False, **options)
        # Whoever uses an executor decides what is tried again.
        self._call = self._ray.remote(num_cpus=1, max_retries=0)(_call).remote
        self._function = self._ray.put(function)  # sent to each machine once
        self._tasks: dict[Any, T] = {}  # by reference to the result

    @property
    def slots(self) -> int:
        """How many tasks may be in flight: more when machines join."""
        cores = int(self._ray.cluster_resources().get("CPU", 0))
        return self._limit or max(1, PER_CPU * cores)

    def submit(self, task: T) -> None:
        """Start a task."""
        self._tasks[self._call(self._function, task)] = task

    def wait(self, timeout: float | None) -> list[tuple[T, R | Lost]]:
        """Return a task that has ended."""
        if not self._tasks:
            time.sleep(timeout or 0)
            return []
        errors = self._ray.exceptions
        ended: list[tuple[T, R | Lost]] = []
        for reference in self._ray.wait(list(self._tasks), timeout=timeout)[0]:
            task = self._tasks.pop(reference)
            try:
                ended.append((task, self._ray.get(reference)))
            except errors.RayTaskError as error:
                if not isinstance(error.cause, OSError):
                    raise error.cause from error
                # Trouble of one machine, such as a full disk; another may do better.
                ended.append((task, Lost(f"{type(error.cause).__name__}: {error}")))
            except errors.RayError as error:
                ended.append((task, Lost(f"lost by Ray: {error}")))
        return ended

    def close(self) -> None:
        """Leave the cluster, or end it if it was started here."""
        self._ray.shutdown()


def _call(function: Callable[[T], R], task: T) -> R:
    return function(task)


def _import_ray() -> Any:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        return import_module("ray")
    except ModuleNotFoundError:
        raise RuntimeError(
            "a Ray cluster needs Ray: pip install 'mpmworlds[cluster]'"
        ) from None
