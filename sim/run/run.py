"""Run a program in a process of its own and bring back its frames.

What simulates is the released text itself: it is written to a file, run by a fresh
interpreter on one CPU thread, and its frames come back through a pipe. Whatever the
program does, the caller gets an `Outcome`.
"""

import json
import os
import platform
import select
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from mpmworlds.files.scratch import Scratch
from mpmworlds.sim.run.child import HEADER, REPORT, STATE, TIME
from mpmworlds.sim.run.compilers import module_of
from mpmworlds.sim.run.track import Recording, Track

Status = Literal[
    "ok",  # frames are complete
    "syntax_error",  # the text is not Python
    "import_error",  # it imports what is not there
    "exception",  # it raised
    "crash",  # a signal ended it, for example an index off the grid
    "killed",  # something else ended it, perhaps for lack of memory
    "timeout",  # it did not end in time
    "out_of_memory",  # it asked for more memory than it may have
    "no_frames",  # it has no frames() or yields nothing
    "bad_frames",  # a frame is not uint8 (H, W, 3), or not like the first
    "no_states",  # states were asked for, and it has none that can be read
]
TIMEOUT = 1800.0  # seconds
MEMORY = 4 << 30  # bytes of address space; Taichi alone reserves 1 GiB
ARM = ("aarch64", "arm64")
TAIL = 2000  # characters kept of what a failed program printed


class RunError(RuntimeError):
    """A program that was needed did not end well."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes
    ----------
    status : str
        "ok" or the kind of failure.
    frames : ndarray of uint8, shape (T, H, W, 3)
        RGB frames up to the end or the failure; T may be 0.
    seconds : float
        Wall time.
    message : str
        What went wrong, empty if nothing did.
    states : Track, optional
        Those of all frames, if they were asked for and there are any.
    """

    status: Status
    frames: npt.NDArray[np.uint8]
    seconds: float
    message: str
    states: Track | None = None

    def expect(self) -> npt.NDArray[np.uint8]:
        """The frames of a run that must have ended well; raises `RunError`."""
        if self.status != "ok":
            raise RunError(f"the program ended in {self.status}: {self.message}")
        return self.frames


def run(
    program_text: str,
    max_frames: int | None = None,
    timeout: float = TIMEOUT,
    memory: int = MEMORY,
    *,
    states: bool = False,
    compiler: str = "taichi",
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

    Returns
    -------
    Outcome
        Never raises for anything that the program does.

    Raises
    ------
    ValueError, RuntimeError
        If there is no such compiler, or it is not installed.
    """
    start, module = time.monotonic(), module_of(compiler)
    with Scratch() as scratch:
        path = scratch.path / "program.py"
        path.write_text(program_text, "utf-8", "surrogatepass")
        log = scratch.path / "log"
        received = Received()
        limits = [max_frames or 0, memory, int(states)]
        status, message = _supervise(
            path, module, log, received, limits, start + timeout
        )
        if status in ("crash", "killed", "exception", "import_error", "out_of_memory"):
            printed = log.read_text("utf-8", "replace")[-TAIL:].strip()
            message = f"{message}\n{printed}".strip()
    return received.outcome(status, message, time.monotonic() - start)


@dataclass(frozen=True)
class Received:
    """What has come through the pipe."""

    frames: list[npt.NDArray[np.uint8]] = field(default_factory=list)
    recording: Recording = field(default_factory=Recording)

    def outcome(self, status: Status, message: str, seconds: float) -> Outcome:
        """All of it, with how the run ended."""
        frames = self.frames
        stack = np.stack(frames) if frames else np.zeros((0, 0, 0, 3), np.uint8)
        found = self.recording.track(len(frames))
        return Outcome(status, stack, seconds, message, found)


def _supervise(
    path: Path,
    module: str,
    log: Path,
    received: Received,
    limits: list[int],
    deadline: float,
) -> tuple[Status, str]:
    """Start the program, gather frames until it ends, and say how it ended."""
    read_end, write_end = os.pipe()
    with (
        as_file(files("mpmworlds.sim.run").joinpath("child.py")) as child,
        log.open("wb") as output,
    ):
        process = subprocess.Popen(
            [sys.executable, "-I", "-X", "faulthandler", str(child), str(path), module]
            + [str(number) for number in (write_end, *limits)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            pass_fds=[write_end],
            cwd=path.parent,
            env=environment(path.parent),
            start_new_session=True,
        )
        os.close(write_end)
        try:
            verdict = collect(read_end, received, deadline)
            if verdict is None:
                process.wait(max(deadline - time.monotonic(), 0.1))
        except (TimeoutError, subprocess.TimeoutExpired):
            count = len(received.frames)
            verdict = "timeout", f"no end within the time allowed; {count} frames"
        finally:
            _kill(process)
            os.close(read_end)
    return verdict or _ending(process.returncode, len(received.frames))


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
    process.wait()


def collect(
    pipe: int, received: Received, deadline: float
) -> tuple[Status, str] | None:
    """Read messages until the pipe closes; a verdict if the child sent one."""
    frames = received.frames
    while header := read_pipe(pipe, HEADER.size, deadline):
        if len(header) < HEADER.size:
            return None
        kind, height, width, length = HEADER.unpack(header)
        payload = read_pipe(pipe, length, deadline)
        if len(payload) < length:
            return None
        if kind == REPORT:
            report = json.loads(payload)
            return report["status"], report["message"]
        if kind == TIME:
            received.recording.begin(payload)
        elif kind == STATE:
            if not received.recording.add(height, width, payload):
                return "no_states", (
                    f"the state of frame {len(frames)} has another size than that of "
                    "frame 0"
                )
        elif frames and frames[0].shape != (height, width, 3):
            size = frames[0].shape[:2]
            return "bad_frames", (
                f"frame {len(frames)} is {(height, width)}, must be {size} like frame 0"
            )
        else:
            frame = np.frombuffer(payload, np.uint8)
            frames.append(frame.reshape(height, width, 3))
    return None


def read_pipe(pipe: int, length: int, deadline: float) -> bytearray:
    """Up to `length` bytes, fewer only at the end; `TimeoutError` past the deadline."""
    data = bytearray()
    while len(data) < length:
        left = deadline - time.monotonic()
        if left <= 0 or not select.select([pipe], [], [], left)[0]:
            raise TimeoutError
        chunk = os.read(pipe, min(length - len(data), 1 << 20))
        if not chunk:
            break
        data += chunk
    return data


def _ending(code: int, count: int) -> tuple[Status, str]:
    """What an exit without a report means."""
    if code == -signal.SIGKILL:
        return "killed", f"ended by SIGKILL after {count} frames"
    if code < 0:
        return "crash", f"ended by {signal.Signals(-code).name}"
    return "crash", f"left with exit code {code} after {count} frames"
