"""Run many short programs: each in a process of its own, forked from a warm one.

Starting an interpreter that imports Taichi takes longer than a short trial. A program
runs as in `run`, from its released text, but may be told to draw no pictures.
"""

import os
import shutil
import tempfile
import time
from pathlib import Path

from mpmworlds.files.closeable import Closeable
from mpmworlds.sim.run.forkserver import ForkServer
from mpmworlds.sim.run.process import MEMORY, check_memory, kill
from mpmworlds.sim.run.receive import (
    Channel,
    Outcome,
    Received,
    Status,
    collect,
)

SHARING = 64  # programs that share kernels; more would be slower to look up
GOODBYE = 10.0  # seconds for a program that has reported to keep its kernels and end


class WarmStart(Closeable):
    """Forks programs from a process that is kept.

    Parameters
    ----------
    memory
        Address space allowed to a program [bytes].

    Raises
    ------
    RuntimeError
        If the shell allows a process too little memory to run any.
    """

    def __init__(self, memory: int = MEMORY) -> None:
        check_memory()
        self._memory = memory
        self._server = ForkServer()
        self._kernels = self._server.scratch.path / "kernels"
        self._sharing = 0

    def run(
        self, program_text: str, max_frames: int, timeout: float, *, pictures: bool
    ) -> Outcome:
        """Run a linked program and collect its states, and its frames if wanted.

        Parameters
        ----------
        program_text
            Text that the linker wrote.
        max_frames
            Frames to run.
        timeout
            Wall time allowed [s].
        pictures
            Whether to draw; else frames show what never moves, at most.

        Returns
        -------
        Outcome
            Never raises for anything that the program does.

        Raises
        ------
        RuntimeError
            If the process that is kept dies, and also the one that takes its place.
        """
        start = time.monotonic()
        with tempfile.TemporaryDirectory(
            dir=self._server.scratch.path,
            ignore_cleanup_errors=True,  # one that is killed may write while it dies
        ) as folder:
            path, log = Path(folder) / "program.py", Path(folder) / "log"
            path.write_text(program_text, "utf-8")
            received = Received(max_frames)
            arguments = {
                "become": "trial",
                "path": str(path),
                "log": str(log),
                "max_frames": max_frames,
                "memory": self._memory,
                "states": True,
                "pictures": pictures,
                "kernels": str(self._kernels),
            }
            reader, writer = os.pipe()
            try:
                process = self._server.fork(arguments, [writer])
            except RuntimeError:
                os.close(reader)
                raise
            finally:
                os.close(writer)
            channel = Channel(reader, start + timeout)
            verdict: tuple[Status, str] | None
            left_well = False
            try:
                verdict = collect(channel, received)
                left_well = verdict is not None and _says_goodbye(reader)
            except TimeoutError:
                verdict = "timeout", f"no end within {timeout:g} s"
            finally:
                kill(process)
                os.close(reader)
        self._sharing += 1
        if not left_well or self._sharing >= SHARING:
            shutil.rmtree(self._kernels, ignore_errors=True)
            self._sharing = 0
        status, message = verdict or ("crash", "it ended without a report")
        seconds = time.monotonic() - start
        return received.outcome(status, message, seconds)

    def close(self) -> None:
        """End the process that is kept."""
        self._server.close()


def _says_goodbye(pipe: int) -> bool:
    """Whether a program that has reported has also written its kernels."""
    try:
        return bool(Channel(pipe, time.monotonic() + GOODBYE).read(1))
    except TimeoutError:
        return False
