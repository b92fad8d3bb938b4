"""Output whose reader may leave: `mpmworlds verify DIR | head -1`."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any


class _Patient:
    """A stream that drops what nobody reads any more."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._is_open = True

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        if self._is_open:
            with self._as_long_as_there_is_a_reader():
                return int(self._stream.write(text))
        return len(text)

    def flush(self) -> None:
        if self._is_open:
            with self._as_long_as_there_is_a_reader():
                self._stream.flush()

    @contextmanager
    def _as_long_as_there_is_a_reader(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            self._is_open = False
            with suppress(OSError, ValueError):  # what is buffered has to go somewhere
                os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())


@contextmanager
def readers_may_leave() -> Iterator[None]:
    """Let a verb go on to its end, and to its exit status, when nobody reads on."""
    plain: tuple[Any, Any] = (sys.stdout, sys.stderr)
    patient: tuple[Any, Any] = (_Patient(plain[0]), _Patient(plain[1]))
    sys.stdout, sys.stderr = patient
    try:
        yield
    finally:
        for stream in patient:
            stream.flush()
        sys.stdout, sys.stderr = plain
