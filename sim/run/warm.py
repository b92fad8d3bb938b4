"""Run many short programs: each in a process of its own, forked from a warm one.

Starting an interpreter that imports Taichi takes longer than a short trial. A program
runs as in `run`, from its released text, but may be told to draw no pictures.
"""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from importlib.resources import as_file, files
from pathlib import Path

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.scratch import Scratch
from mpmworlds.sim.run.receive import (
    TAIL,
    Channel,
    Outcome,
    Received,
    Status,
    collect,
)
from mpmworlds.sim.run.run import MEMORY, check_memory, environment

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
        self._scratch = Scratch()
        self._kernels = self._scratch.path / "kernels"
        self._log = self._scratch.path / "log"
        self._sharing = 0
        self._start()

    def _start(self) -> None:
        self._socket, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with (
            as_file(files("mpmworlds.sim.run").joinpath("zygote.py")) as script,
            self._log.open("wb") as log,
            other,
        ):
            self._process = subprocess.Popen(
                [sys.executable, "-I", str(script), str(other.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                pass_fds=[other.fileno()],
                env=environment(self._scratch.path),
                start_new_session=True,
            )

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
            dir=self._scratch.path,
            ignore_cleanup_errors=True,  # one that is killed may write while it dies
        ) as folder:
            path, log = Path(folder) / "program.py", Path(folder) / "log"
            path.write_text(program_text, "utf-8")
            received = Received(max_frames)
            arguments = {
                "path": str(path),
                "log": str(log),
                "max_frames": max_frames,
                "memory": self._memory,
                "states": True,
                "pictures": pictures,
                "kernels": str(self._kernels),
            }
            pid, reader = self._fork(json.dumps(arguments).encode())
            channel = Channel(reader, start + timeout)
            verdict: tuple[Status, str] | None
            left_well = False
            try:
                verdict = collect(channel, received)
                left_well = verdict is not None and _says_goodbye(reader)
            except TimeoutError:
                verdict = "timeout", f"no end within {timeout:g} s"
            finally:
                with suppress(ProcessLookupError):
                    os.killpg(pid, signal.SIGKILL)
                os.close(reader)
        self._sharing += 1
        if not left_well or self._sharing >= SHARING:
            shutil.rmtree(self._kernels, ignore_errors=True)
            self._sharing = 0
        status, message = verdict or ("crash", "it ended without a report")
        seconds = time.monotonic() - start
        return received.outcome(status, message, seconds)

    def _fork(self, message: bytes) -> tuple[int, int]:
        """Number of a new process, and the end of its pipe."""
        for attempt in ("first", "last"):
            reader, writer = os.pipe()
            try:
                socket.send_fds(self._socket, [message], [writer])
                answer = self._socket.recv(8)
            except OSError:
                answer = b""
            finally:
                os.close(writer)
            if answer:
                return int.from_bytes(answer, "little"), reader
            os.close(reader)
            self._stop()
            if attempt == "first":
                self._start()
        printed = self._log.read_text("utf-8", "replace")[-TAIL:].strip()
        raise RuntimeError(
            "the process that programs are forked from has died twice, perhaps for "
            "lack of memory; run the command again, what is finished is kept. "
            f"It says: {printed or 'nothing'}"
        )

    def _stop(self) -> None:
        self._socket.close()
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End the process that is kept."""
        self._stop()
        self._scratch.close()


def _says_goodbye(pipe: int) -> bool:
    """Whether a program that has reported has also written its kernels."""
    try:
        return bool(Channel(pipe, time.monotonic() + GOODBYE).read(1))
    except TimeoutError:
        return False
