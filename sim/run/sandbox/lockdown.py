"""Lock a process up in itself: what it may read, call and use up.

Called by the child, before it has seen the program. What is loaded then stays usable,
and what a simulation still looks up may be read; the rest of the machine is gone.
"""

import ctypes
import os
import resource
import site
import struct
import sys
import sysconfig
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from . import landlock, libc, namespaces, seccomp, syscalls

PROCESSES: Final = 64  # and threads
FILES: Final = 64
OWN_USER: Final = 0x60000000  # plus a number that two sandboxes rarely share
CAP_DAC_READ_SEARCH: Final = 1 << 2
CAPABILITY_VERSION: Final = 0x20080522
SYSTEM: Final = ("/lib", "/lib32", "/lib64", "/usr/lib", "/usr/lib32", "/usr/lib64")
LOADER: Final = ("/etc/ld.so.cache",)
OURS: Final = "mpmworlds"  # holds scenes and hidden frames: no program may read it


class Places(NamedTuple):
    """What there is to read."""

    trees: list[str]  # files and folders
    hidden: list[str]  # what is not to be read below them
    readable: list[str]  # the same without what is hidden: parts of those trees
    listable: list[str]  # folders on the way to what is hidden


def places(folder: str) -> Places:
    """What a program may read: Python, its packages but ours, and its own folder."""
    kinds = ("stdlib", "platstdlib", "purelib", "platlib")
    python = {*(sysconfig.get_path(kind) for kind in kinds), *site.getsitepackages()}
    for prefix in {sys.prefix, sys.base_prefix} - {"/", "/usr"}:
        python |= {os.path.join(prefix, "lib"), os.path.join(prefix, "pyvenv.cfg")}
    real = {os.path.realpath(path) for path in python}
    hidden = [
        os.path.join(path, name)
        for path in sorted(real)
        if path.endswith("-packages") and os.path.isdir(path)
        for name in sorted(os.listdir(path))
        if name.lower().lstrip("_").startswith((OURS, f"editable___{OURS}"))
    ]
    trees = sorted({*real, *SYSTEM, *LOADER, *namespaces.DEVICES, folder})
    readable: list[str] = []
    listable: list[str] = []
    for tree in trees:
        _divide(tree, hidden, readable, listable)
    return Places(trees, hidden, readable, listable)


def _divide(
    path: str, hidden: Sequence[str], readable: list[str], listable: list[str]
) -> None:
    """Name the largest parts of a tree that hold nothing hidden."""
    if path in hidden:
        return
    if not any(other.startswith(path + os.sep) for other in hidden):
        readable.append(path)
        return
    listable.append(path)
    for name in sorted(os.listdir(path)):
        _divide(os.path.join(path, name), hidden, readable, listable)


def limit(what: int, value: int) -> None:
    """Lower a limit, as far as it is not lower by now."""
    _, hard = resource.getrlimit(what)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    resource.setrlimit(what, (value, value))


def lock(
    found: Places, seconds: int, pipes: Sequence[int], layers: Sequence[str]
) -> dict[str, Any]:
    """Lock this process up; for ever.

    Parameters
    ----------
    found
        What it may read.
    seconds
        Time on a processor that it may take [s].
    pipes
        What it keeps open, besides the standard streams.
    layers
        Namespaces that it is in.

    Returns
    -------
    dict
        What the sandbox is made of: `landlock` (version of its interface, 0 if there is
        none), `seccomp`, `namespaces`, `user` (its number).

    Raises
    ------
    OSError
        If a part that this machine has cannot be set up.
    RuntimeError
        If there is a second thread, which would stay outside.
    """
    _close_others(pipes)
    limit(resource.RLIMIT_CPU, seconds)
    limit(resource.RLIMIT_NOFILE, FILES)
    for what in ("CORE", "FSIZE", "MEMLOCK", "MSGQUEUE"):
        limit(getattr(resource, f"RLIMIT_{what}"), 0)
    user = _become_nobody()
    tasks = 0 if user or "user" in layers else _tasks_of(os.getuid())
    limit(resource.RLIMIT_NPROC, PROCESSES + tasks)
    libc.prctl(libc.PR_SET_PDEATHSIG, 9)  # a change of the user has cleared it
    libc.prctl(libc.PR_SET_DUMPABLE, 0)
    libc.prctl(libc.PR_SET_NO_NEW_PRIVS, 1)
    if len(os.listdir("/proc/self/task") if os.path.isdir("/proc/self") else "1") != 1:
        raise RuntimeError("a second thread would stay outside of the sandbox")
    version = landlock.restrict(found.readable, found.listable)
    filtered = syscalls.machine() is not None
    if filtered:
        seccomp.install()
    return {
        "landlock": version,
        "seccomp": filtered,
        "namespaces": list(layers),
        "user": os.getuid(),
    }


def _close_others(pipes: Sequence[int]) -> None:
    start = 3
    for pipe in sorted(pipes):
        os.closerange(start, pipe)
        start = pipe + 1
    os.closerange(start, 4096)


def _become_nobody() -> int:
    """Let the superuser be a user of its own, whose threads are counted; its number.

    It can still read the packages that only the superuser may, but Landlock holds.
    """
    if os.getuid() != 0:
        _keep_capabilities(0)
        return 0
    number = OWN_USER + int.from_bytes(os.urandom(3), "little")
    try:
        os.setgroups([])
        libc.prctl(libc.PR_SET_KEEPCAPS, 1)
        os.setresgid(number, number, number)
        os.setresuid(number, number, number)
    except OSError:
        return 0  # a container that knows few users
    _keep_capabilities(CAP_DAC_READ_SEARCH)
    return number


def _keep_capabilities(kept: int) -> None:
    header = struct.pack("<Ii", CAPABILITY_VERSION, 0)
    data = struct.pack("<6I", kept, kept, 0, 0, 0, 0)
    number = syscalls.number("capset")
    libc.syscall(number, ctypes.c_char_p(header), ctypes.c_char_p(data))


def _tasks_of(user: int) -> int:
    """Threads that a user has now: a limit counts them, too."""
    count = 0
    for name in os.listdir("/proc"):
        try:
            if name.isdecimal() and os.stat(f"/proc/{name}").st_uid == user:
                count += len(os.listdir(f"/proc/{name}/task"))
        except OSError:  # it has ended
            continue
    return count
