"""Work for many items in several processes, its results in their order."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")


def in_order(
    work: Callable[[T], R], items: Sequence[T], workers: int = 0
) -> Iterator[R]:
    """Yield the results of a function for some items, in their order.

    Parameters
    ----------
    work
        The function, which pickles.
    items
        What to call it with.
    workers
        Number of processes: 1 for this one alone, 0 for one per core.

    Raises
    ------
    ValueError
        If the number is negative.
    """
    if workers < 0:
        raise ValueError(f"workers = {workers}, must be >= 0 (0: one per core)")
    if workers == 1:
        yield from map(work, items)
        return
    # Not by fork: what is loaded has threads.
    count = min(workers or os.cpu_count() or 1, max(1, len(items)))
    pool = ProcessPoolExecutor(count, get_context("spawn"), _follow_parent)
    try:
        yield from pool.map(work, items)
    finally:
        pool.shutdown(cancel_futures=True)


def _follow_parent() -> None:
    """Leave Ctrl-C to the parent, and end when it has ended, however it did."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGKILL)
