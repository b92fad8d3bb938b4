"""What the processes of programs have in common, however they were begun."""

import os
import platform
import resource
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Final, Protocol

MEMORY: Final = 4 << 30  # bytes of address space; Taichi alone reserves 1 GiB
LEAST_MEMORY: Final = 2 << 30  # bytes: with 1.5 GiB it does not start
DYING: Final = 10.0  # seconds that a killed process may take to go
ARM: Final = ("aarch64", "arm64")


class Process(Protocol):
    """A process that leads a session, as `subprocess.Popen` has it."""

    pid: int
    returncode: int | None

    def poll(self) -> int | None:
        """How it ended, negative for a signal; None while it runs."""

    def wait(self, timeout: float) -> int:
        """Wait for its end [s]; raises `subprocess.TimeoutExpired`."""

    def kill(self) -> None:
        """End it."""


def kill(process: Process) -> None:
    """End a process, and also what it started and left behind."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()  # in case that it leads no session yet
    with suppress(subprocess.TimeoutExpired):  # then the kernel is still at it
        process.wait(DYING)


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
