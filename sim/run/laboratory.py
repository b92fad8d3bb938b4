"""Run many linked programs that differ little, in one process that keeps kernels.

A short trial takes less time than what comes before it: a start, and kernels to be
compiled or looked up. Here only the first of programs that share kernels pays for them.
"""

import json
import os
import tempfile
import time
from pathlib import Path
from typing import Final

from mpmworlds.files.closeable import Closeable
from mpmworlds.sim.run.forkserver import Forked, ForkServer
from mpmworlds.sim.run.process import MEMORY, check_memory, kill
from mpmworlds.sim.run.receive import Channel, Outcome, Received, Status, collect

SHARING: Final = 100  # programs that a process runs; kernels of a kind take 20 MB


class Laboratory(Closeable):
    """A process for programs of the linker, see `sim.run.lifted`.

    Raises
    ------
    RuntimeError
        If the shell allows a process too little memory to run any.
    """

    def __init__(self) -> None:
        check_memory()
        self._server = ForkServer()
        self._process: Forked | None = None
        self._reader = self._writer = -1  # its messages, and requests to it
        self._count = 0

    def run(self, program_text: str, max_frames: int, timeout: float) -> Outcome:
        """Run a program and collect its frames.

        Parameters
        ----------
        program_text
            Text that the linker wrote.
        max_frames
            Frames to run.
        timeout
            Wall time allowed [s].

        Returns
        -------
        Outcome
            Never raises for anything that the program does.

        Raises
        ------
        RuntimeError
            If the process that programs are forked from dies, and also the one that
            takes its place.
        """
        outcome = self._run(program_text, max_frames, timeout)
        if outcome.status not in ("ok", "timeout") and self._count > 1:
            self._end()  # what it has kept may be in the way
            outcome = self._run(program_text, max_frames, timeout)
        if outcome.status != "ok":  # it may have left anything behind
            self._end()
        return outcome

    def _run(self, program_text: str, max_frames: int, timeout: float) -> Outcome:
        start = time.monotonic()
        if self._process is None or self._count >= SHARING:
            self._begin()
        self._count += 1
        received = Received(max_frames)
        verdict: tuple[Status, str] | None
        with tempfile.TemporaryDirectory(dir=self._server.scratch.path) as folder:
            path = Path(folder) / "program.py"
            path.write_text(program_text, "utf-8")
            request = json.dumps({"path": str(path), "max_frames": max_frames})
            try:
                os.write(self._writer, f"{request}\n".encode())
                verdict = collect(Channel(self._reader, start + timeout), received)
            except BrokenPipeError:
                verdict = None
            except TimeoutError:
                verdict = "timeout", f"no end within {timeout:g} s"
        status, message = verdict or ("crash", "it ended without a report")
        return received.outcome(status, message, time.monotonic() - start)

    def _begin(self) -> None:
        self._end()
        reader, messages = os.pipe()
        requests, writer = os.pipe()
        arguments = {
            "become": "laboratory",
            "log": str(self._server.scratch.path / "printed"),
            "memory": MEMORY,
        }
        try:
            self._process = self._server.fork(arguments, [messages, requests])
        except RuntimeError:
            os.close(reader)
            os.close(writer)
            raise
        finally:
            os.close(messages)
            os.close(requests)
        self._reader, self._writer, self._count = reader, writer, 0

    def _end(self) -> None:
        if self._process is not None:
            kill(self._process)
            os.close(self._reader)
            os.close(self._writer)
            self._process = None

    def close(self) -> None:
        """End the process, and the one that it was forked from."""
        self._end()
        self._server.close()
