"""Run a program in a process of its own and bring back its frames.

What simulates is the released text itself: it is written to a file, run by a fresh
interpreter on one CPU thread, and its frames come back through a pipe. Whatever the
program does, the caller gets an `Outcome`, in time. A text that the linker did not
write just now is run in a sandbox, see `sim.run.sandbox`.
"""

import json
import math
import os
import platform
import resource
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, Final

from mpmworlds.files.scratch import Scratch
from mpmworlds.sim.run.compilers import module_of
from mpmworlds.sim.run.receive import (
    Channel,
    Outcome,
    Received,
    Refused,
    RunError,
    Verdict,
    Watch,
    collect,
)

__all__ = ["MEMORY", "TIMEOUT", "Outcome", "RunError", "SandboxError", "run"]

TIMEOUT: Final = 1800.0  # seconds
MEMORY: Final = 4 << 30  # bytes of address space; Taichi alone reserves 1 GiB
LEAST_MEMORY: Final = 2 << 30  # bytes: with 1.5 GiB it does not start
DYING: Final = 10.0  # seconds that a killed process may take to go
ARM: Final = ("aarch64", "arm64")
TALKATIVE: Final = ("crash", "killed", "exception", "import_error", "out_of_memory")


class SandboxError(RuntimeError):
    """Nobody here wrote the program, and the machine cannot confine it."""


def run(
    program_text: str,
    max_frames: int | None = None,
    timeout: float = TIMEOUT,
    memory: int = MEMORY,
    *,
    states: bool = False,
    compiler: str = "taichi",
    trusted: bool = False,
    watch: Watch | None = None,
) -> Outcome:
    """Run a program and collect its frames.

    Parameters
    ----------
    program_text : str
        A Python file with a `frames()` generator of uint8 (H, W, 3) RGB frames.
    max_frames : int, optional
        Stop after so many frames.
    timeout : float
        Wall time allowed [s].
    memory : int
        Address space allowed [bytes].
    states : bool
        Read the state of matter and solids at every frame, too; the frames are the
        same. It takes a few names at the top of the program, see `sim.run.child`.
    compiler : str
        What the program gets as `taichi`, see `sim.run.compilers`.
    trusted : bool
        Run it without a sandbox. For the text that `link` returns; any other one can do
        then what you can.
    watch : callable, optional
        Asked after every frame, with the list of all so far, whether to go on; if not,
        the run ends well, with those frames.

    Returns
    -------
    Outcome
        Never raises for anything that the program does.

    Raises
    ------
    ValueError, RuntimeError
        If there is no such compiler, it is not installed, or the shell allows a process
        too little memory to run any.
    SandboxError
        If this machine cannot confine a program that is not trusted.
    """
    start, module = time.monotonic(), module_of(compiler)
    check_memory()
    with Scratch() as scratch:
        path = scratch.path / "program.py"
        path.write_text(program_text, "utf-8", "surrogatepass")
        received = Received(max_frames or 0, watch)
        arguments = {
            "path": str(path),
            "compiler": module,
            "max_frames": max_frames or 0,
            "memory": memory,
            "states": states,
            # On one processor at a time, so that a second thread gains nothing.
            "sandbox": None if trusted else math.ceil(timeout) + 1,
        }
        status, message = _supervise(arguments, received, start + timeout)
    if not trusted and (received.seal or status != "timeout"):  # else it never began
        _check_seal(received, message)
    return received.outcome(status, message, time.monotonic() - start)


def check_memory() -> None:
    """Raise `RuntimeError` if a shell's limit is too low for any program to run.

    Else it would seem to be the program's fault.
    """
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard != resource.RLIM_INFINITY and hard < LEAST_MEMORY:
        raise RuntimeError(
            f"a process may have {hard >> 20} MiB of address space here (ulimit -v), "
            f"must be at least {LEAST_MEMORY >> 20} to run a program; raise the limit"
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


def _supervise(
    arguments: dict[str, Any], received: Received, deadline: float
) -> Verdict:
    """Start the program, gather frames until it ends, and say how it ended."""
    folder = Path(arguments["path"]).parent
    with ExitStack() as stack:
        child = stack.enter_context(
            as_file(files("mpmworlds.sim.run").joinpath("child.py"))
        )
        (frames, frames_in), (printed, printed_in) = os.pipe(), os.pipe()
        for pipe in (frames, printed):
            stack.callback(os.close, pipe)
        given = json.dumps(arguments | {"pipe": frames_in})
        try:
            process = subprocess.Popen(
                [sys.executable, "-I", "-X", "faulthandler", str(child), given],
                stdin=subprocess.DEVNULL,
                stdout=printed_in,
                stderr=printed_in,
                pass_fds=[frames_in],
                cwd=folder,
                env=environment(folder),
                start_new_session=True,
            )
        finally:
            os.close(frames_in)
            os.close(printed_in)
        channel = Channel(frames, deadline, printed, process)
        try:
            verdict = collect(channel, received)
            if verdict is None:
                channel.wait_for_end()
        except TimeoutError:
            count = len(received.frames)
            verdict = "timeout", f"no end within the time allowed; {count} frames"
        except Refused as refused:
            verdict = refused.verdict
        finally:
            _kill(process)
        status, message = verdict or _ending(process.returncode, len(received.frames))
        if status in TALKATIVE:
            message = f"{message}\n{channel.tail()}".strip()
    return status, message


def environment(home: Path) -> dict[str, str]:
    """What a program sees: no user settings, one thread, no call home."""
    kept = {name: os.environ[name] for name in ("PATH", "LANG") if name in os.environ}
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
    quiet = {"SKIP_VERSION_CHECK": "ON", "LOG_LEVEL": "error"}
    quiet |= {"ARCH": "arm64" if platform.machine() in ARM else "x64"}
    quiet |= {"OFFLINE_CACHE": "0", "CPU_MAX_NUM_THREADS": "1"}
    prefixes = "TI", "QD"  # Taichi and Taichi Forge, Quadrants
    quiet = {f"{prefix}_{name}": quiet[name] for prefix in prefixes for name in quiet}
    return kept | threads | quiet | {"HOME": str(home), "TMPDIR": str(home)}


def _kill(process: "subprocess.Popen[bytes]") -> None:
    """End the program, and also what it started and left behind."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    with suppress(subprocess.TimeoutExpired):  # then the kernel is still at it
        process.wait(DYING)


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
