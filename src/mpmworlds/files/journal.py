"""A file that only grows, line by line, and survives any stop.

What is appended is on the disk on return, or not in the file at all. A line that was
not written whole, because the process was killed in the middle, is no line.
"""

import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.disk import disk_errors_named
from mpmworlds.files.posix import needed
from mpmworlds.files.targets import check_file


def read_records(path: Path) -> list[Any]:
    """JSON of every whole line of a journal; nothing if there is no such file."""
    if not path.exists():
        return []
    with Journal(path, wait=True) as journal:
        return [json.loads(line) for _, line, _ in journal.lines()]


def append_records(path: Path, records: Iterable[Any]) -> None:
    """Add JSON to a journal, a line each, after its last whole line.

    Raises
    ------
    DiskFullError
        If there is no room; the journal stays as it was.
    """
    with Journal(path, wait=True) as journal:
        journal.cut(journal.end())
        journal.append("".join(json.dumps(record) + "\n" for record in records))


class JournalBusyError(ValueError):
    """Another process is writing the file."""


class Journal(Closeable):
    """A file of lines open for going on with, held by one process at a time.

    Parameters
    ----------
    path
        The file. Made, with its folder, if it is not there.
    wait
        Whether to wait for a process that holds it.

    Raises
    ------
    JournalBusyError
        If another process holds it and this one is not to wait.
    DiskFullError
        If there is no room for it.
    """

    def __init__(self, path: Path, *, wait: bool = False) -> None:
        check_file(path)
        fcntl = needed("fcntl")
        self.path = path
        with disk_errors_named(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("a+b")
        try:
            how = fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB)
            fcntl.flock(self._stream, how)
        except BaseException as error:
            self._stream.close()
            if not isinstance(error, BlockingIOError):
                raise
            raise JournalBusyError(
                f"{path}: another process is writing it; wait for it"
            ) from error

    def lines(self) -> Iterator[tuple[int, bytes, int]]:
        """Yield number, bytes and end of every whole line."""
        self._stream.seek(0)
        end = 0
        for number, line in enumerate(self._stream, 1):
            if not line.endswith(b"\n"):
                return
            end += len(line)
            yield number, line, end

    def cut(self, end: int) -> int:
        """Drop what follows a place; returns how many bytes that were."""
        size = self._stream.seek(0, os.SEEK_END)
        if end < size:
            self._stream.truncate(end)
        return size - end

    def end(self) -> int:
        """Where the last whole line ends."""
        size = self._stream.seek(0, os.SEEK_END)
        start, found = size, -1
        while start and found < 0:
            start = max(start - (1 << 16), 0)
            self._stream.seek(start)
            found = self._stream.read(size - start).rfind(b"\n")
        return start + found + 1

    def append(self, text: str) -> None:
        """Add whole lines, or none and raise `OSError`, `DiskFullError` for one."""
        end = self._stream.seek(0, os.SEEK_END)
        descriptor = self._stream.fileno()
        left = memoryview(text.encode())
        with disk_errors_named(self.path):
            try:
                while left:
                    left = left[os.write(descriptor, left) :]
                os.fsync(descriptor)
            except OSError:
                os.ftruncate(descriptor, end)
                raise

    def close(self) -> None:
        """Let go of the file."""
        self._stream.close()
