"""A program that runs in a process of its own, as far as it is asked to."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, Final

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.scratch import Scratch
from mpmworlds.sim.run.compilers import module_of
from mpmworlds.sim.run.forkserver import ForkServer
from mpmworlds.sim.run.process import (
    MEMORY,
    Process,
    check_memory,
    environment,
    kill,
)
from mpmworlds.sim.run.receive import (
    Channel,
    Keep,
    Outcome,
    Received,
    Refused,
    Verdict,
    Watch,
    collect,
)

TIMEOUT: Final = 1800.0  # seconds
TALKATIVE: Final = ("crash", "killed", "exception", "import_error", "out_of_memory")


class SandboxError(RuntimeError):
    """Nobody here wrote the program, and the machine cannot confine it."""


class Running(Closeable):
    """Begin a program; it goes on while somebody takes its frames.

    Its pipe holds less than a frame: while nobody reads, it waits.

    Parameters
    ----------
    program_text, max_frames, timeout, memory, states, compiler, trusted
        As for `sim.run.run.run`. The time allowed is that in which it goes on.
    server
        Fork it from there, which is faster; else a fresh interpreter is started.
    keep
        What to keep of each frame, of its number and itself; None for nothing of it.
        Only that is handed out.

    Raises
    ------
    ValueError, RuntimeError
        As `run` does.
    """

    def __init__(
        self,
        program_text: str,
        max_frames: int | None = None,
        timeout: float = TIMEOUT,
        memory: int = MEMORY,
        *,
        states: bool = False,
        compiler: str = "taichi",
        trusted: bool = False,
        server: ForkServer | None = None,
        keep: Keep | None = None,
    ) -> None:
        start, module = time.monotonic(), module_of(compiler)
        check_memory()
        self._trusted = trusted
        self._received = Received(max_frames or 0, keep=keep)
        self._verdict: Verdict | None = None
        with ExitStack() as stack:
            scratch = stack.enter_context(Scratch())
            path = scratch.path / "program.py"
            path.write_text(program_text, "utf-8", "surrogatepass")
            arguments = {
                "path": str(path),
                "compiler": module,
                "max_frames": max_frames or 0,
                "memory": memory,
                "states": states,
                # On one processor at a time, so that a second thread gains nothing.
                "sandbox": None if trusted else math.ceil(timeout) + 1,
            }
            (frames, frames_in), (printed, printed_in) = os.pipe(), os.pipe()
            for pipe in (frames, printed):
                stack.callback(os.close, pipe)
            try:
                self._process = _begin(arguments, (frames_in, printed_in), server)
            finally:
                os.close(frames_in)
                os.close(printed_in)
            stack.callback(kill, self._process)
            self._resources = stack.pop_all()
        self._channel = Channel(frames, 0.0, printed, self._process)
        self._took = time.monotonic() - start
        self._left = timeout

    def go_on(self, watch: Watch | None = None) -> Outcome:
        """Take more frames.

        Parameters
        ----------
        watch
            As for `run`. If it says no, the program waits, and can go on later.

        Returns
        -------
        Outcome
            With all frames so far, and the seconds that this took. How a program ended
            stays so.

        Raises
        ------
        SandboxError
            If this machine cannot confine a program that is not trusted.
        """
        start = time.monotonic() - self._took
        self._took = 0.0
        received = self._received
        received.watch, received.waits = watch, False
        verdict = self._verdict or self._collect(start + self._left)
        seconds = time.monotonic() - start
        self._left -= seconds
        if not received.waits:
            self._verdict = verdict
        status, message = verdict
        # One that is out of time may never have begun.
        if not self._trusted and (received.seal or status != "timeout"):
            _check_seal(received, message)
        return received.outcome(status, message, seconds)

    def _collect(self, deadline: float) -> Verdict:
        channel, received = self._channel, self._received
        channel.deadline = deadline
        try:
            verdict = collect(channel, received)
            if verdict is None:
                channel.wait_for_end()
        except TimeoutError:
            count = received.count
            verdict = "timeout", f"no end within the time allowed; {count} frames"
        except Refused as refused:
            verdict = refused.verdict
        if received.waits and verdict:
            return verdict
        kill(self._process)
        code = self._process.returncode
        status, message = verdict or _ending(code, received.count)
        if status in TALKATIVE:
            message = f"{message}\n{channel.tail()}".strip()
        return status, message

    def close(self) -> None:
        """End it."""
        self._resources.close()


def _begin(
    arguments: dict[str, Any], pipes: Sequence[int], server: ForkServer | None
) -> Process:
    """Start a process that writes its messages and what it prints to two pipes."""
    if server:
        return server.fork({**arguments, "become": "program"}, pipes)
    messages, printed = pipes
    folder = os.path.dirname(arguments["path"])
    with as_file(files("mpmworlds.sim.run").joinpath("child.py")) as child:
        return subprocess.Popen(
            [
                *(sys.executable, "-I", "-X", "faulthandler", str(child)),
                json.dumps(arguments | {"pipe": messages}),
            ],
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=printed,
            pass_fds=[messages],
            cwd=folder,
            env=environment(Path(folder)),
            start_new_session=True,
        )


def _check_seal(received: Received, message: str) -> None:
    """Raise unless the sandbox was closed around the program in time."""
    seal = received.seal
    if seal is None:
        raise SandboxError(
            f"the sandbox could not be set up: {message or 'its process ended'}"
        )
    files_are_safe = seal.get("landlock") or "mount" in seal.get("namespaces", ())
    if not (seal.get("seccomp") and files_are_safe):
        raise SandboxError(
            "this machine cannot confine a program that nobody here wrote: it takes "
            "seccomp, and Landlock (Linux 5.13) or namespaces; see mpmworlds doctor. "
            "Run it on another machine or in a virtual one, or, if you trust the "
            "program with all that you may do, with --unsafe-no-sandbox"
        )


def _ending(code: int | None, count: int) -> Verdict:
    """What an exit without a report means."""
    if code is None or code == -signal.SIGKILL:
        return "killed", f"ended by SIGKILL after {count} frames"
    if code == -signal.SIGSYS:
        return "forbidden", f"it made a call of another system after {count} frames"
    if code == -signal.SIGXCPU:
        return "timeout", f"it used up its time on a processor; {count} frames"
    if code < 0:
        return "crash", f"ended by {signal.Signals(-code).name}"
    return "crash", f"left with exit code {code} after {count} frames"
