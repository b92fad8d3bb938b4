"""A process that has imported what programs import, and is forked for each of them.

Starting an interpreter that imports Taichi takes a second. What is forked sees nothing
of the programs before it; one that nobody here wrote is locked up after the fork.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.resources import as_file, files
from typing import Any, Final

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.scratch import Scratch
from mpmworlds.sim.run.process import environment
from mpmworlds.sim.run.receive import TAIL
from mpmworlds.sim.run.zygote import ANSWER, RUNNING

OFTEN: Final = 0.002  # seconds between questions


class Forked:
    """A process that was forked from a server; see `process.Process`."""

    def __init__(self, pid: int, server: "ForkServer") -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._server = server

    def poll(self) -> int | None:
        """How it ended, negative for a signal; None while it runs."""
        if self.returncode is None:
            self.returncode = self._server.ending_of(self.pid)
        return self.returncode

    def wait(self, timeout: float) -> int:
        """Wait for its end [s]; raises `subprocess.TimeoutExpired`."""
        deadline = time.monotonic() + timeout
        while (code := self.poll()) is None:
            if time.monotonic() > deadline:
                raise subprocess.TimeoutExpired(f"process {self.pid}", timeout)
            time.sleep(OFTEN)
        return code

    def kill(self) -> None:
        """End it. Until it has been asked about, its number stays its own."""
        if self.returncode is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)


class ForkServer(Closeable):
    """Start the process, and fork from it.

    Attributes
    ----------
    scratch
        A folder that goes with the server.
    """

    def __init__(self) -> None:
        self.scratch = Scratch()
        self._log = self.scratch.path / "log"
        self._start()

    @property
    def pid(self) -> int:
        """Number of the process that is kept."""
        return self._process.pid

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
                env=environment(self.scratch.path),
                start_new_session=True,
            )

    def fork(self, arguments: Mapping[str, Any], pipes: Sequence[int]) -> Forked:
        """Begin a program.

        Parameters
        ----------
        arguments
            See `zygote.py`.
        pipes
            What it gets to write to; they stay open here.

        Raises
        ------
        RuntimeError
            If the process that is kept dies, and also the one that takes its place.
        """
        message = json.dumps(arguments).encode()
        for attempt in ("first", "last"):
            try:
                socket.send_fds(self._socket, [message], pipes)
                answer = self._socket.recv(ANSWER.size)
            except OSError:
                answer = b""
            if answer:
                return Forked(ANSWER.unpack(answer)[0], self)
            self._stop()
            if attempt == "first":
                self._start()
        printed = self._log.read_text("utf-8", "replace")[-TAIL:].strip()
        raise RuntimeError(
            "the process that programs are forked from has died twice, perhaps for "
            "lack of memory; run the command again, what is finished is kept. "
            f"It says: {printed or 'nothing'}"
        )

    def ending_of(self, pid: int) -> int | None:
        """How a forked process ended; None while it runs."""
        try:
            self._socket.sendall(json.dumps({"about": pid}).encode())
            answer = self._socket.recv(ANSWER.size)
        except OSError:
            answer = b""
        if not answer:
            return -signal.SIGKILL  # it has died with its server
        (status,) = ANSWER.unpack(answer)
        return None if status == RUNNING else os.waitstatus_to_exitcode(status)

    def _stop(self) -> None:
        self._socket.close()
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End the process that is kept, and with it all that was forked from it."""
        self._stop()
        self.scratch.close()
