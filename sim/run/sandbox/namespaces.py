"""Namespaces: no network, no other processes, and a file system of its own.

They need no rights where the machine lets users have namespaces; the superuser needs
none of those. Where neither works, lockdown is the only layer.
"""

import contextlib
import ctypes
import os
import signal
import struct
from collections.abc import Iterable, Sequence
from typing import Final

from . import libc, syscalls

NEW: Final = {
    "mount": 0x00020000,
    "cgroup": 0x02000000,
    "uts": 0x04000000,
    "ipc": 0x08000000,
    "pid": 0x20000000,
    "network": 0x40000000,
}
NEW_USER: Final = 0x10000000
MS_RDONLY, MS_NOSUID, MS_NODEV, MS_NOEXEC = 1, 2, 4, 8
MS_BIND, MS_REC, MS_PRIVATE = 4096, 16384, 1 << 18
AT_FDCWD, AT_RECURSIVE = -100, 0x8000
ATTR_RDONLY, ATTR_NOSUID = 1, 2
STATUS: Final = struct.Struct("i")
DEVICES: Final = ("/dev/null", "/dev/urandom")
WRITABLE: Final = "/dev/shm"  # noqa: S108 - of the new root, where nothing else lies
SMALL: Final = "size=256k,nr_inodes=32,mode=1777"


def enter(
    folder: str, trees: Sequence[str], hidden: Sequence[str], pipes: Sequence[int]
) -> list[str]:
    """Go on as a process in new namespaces; the one that called waits for it.

    It is the second one there: the first of a namespace cannot be killed from within,
    so that signals would not mean to a program what they mean elsewhere. Must be called
    before there is a second thread.

    Parameters
    ----------
    folder
        Where the program lies, a folder of its own.
    trees
        Files and folders that are to be there.
    hidden
        Folders below those that are not.
    pipes
        What only the new process is to hold open.

    Returns
    -------
    list of str
        Names of the namespaces, empty where there can be none.
    """
    flags, found = sum(NEW.values()), [*NEW]
    user, group = os.getuid(), os.getgid()
    if user != 0:
        flags |= NEW_USER
        found.append("user")
    try:
        libc.unshare(flags)
    except OSError:
        return []
    if user != 0:
        _write("/proc/self/setgroups", "deny")
        _write("/proc/self/uid_map", f"{user} {user} 1")
        _write("/proc/self/gid_map", f"{group} {group} 1")
    _go_on_inside(pipes)
    try:
        _new_root(folder, trees, hidden)
    except (OSError, LookupError):
        # What was mounted is seen by this process only; Landlock must do.
        found.remove("mount")
    return found


def _write(path: str, text: str) -> None:
    with open(path, "w", encoding="ascii") as file:
        file.write(text)


def _go_on_inside(pipes: Sequence[int]) -> None:
    """Return in the second process of the new namespace; the others wait for it."""
    told, tell = os.pipe()
    first = os.fork()
    libc.prctl(libc.PR_SET_PDEATHSIG, signal.SIGKILL)
    if first:
        _close(*pipes, tell, 1, 2)
        os.waitpid(first, 0)
        _end_like(os.read(told, STATUS.size))
    second = os.fork()
    if second:
        _close(*pipes, told, 1, 2)
        process, status = os.wait()
        while process != second:
            process, status = os.wait()
        os.write(tell, STATUS.pack(status))
        os._exit(0)
    libc.prctl(libc.PR_SET_PDEATHSIG, signal.SIGKILL)
    _close(told, tell)


def _close(*pipes: int) -> None:
    for pipe in pipes:
        os.close(pipe)


def _end_like(told: bytes) -> None:
    """End as another process has; never returns."""
    status = STATUS.unpack(told)[0] if told else signal.SIGKILL
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        with contextlib.suppress(OSError):  # of those that cannot be handled
            signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    os._exit(os.waitstatus_to_exitcode(status) & 255)


def _new_root(folder: str, trees: Iterable[str], hidden: Iterable[str]) -> None:
    """Make a root of what may be read, nothing of it writable, and move there."""
    libc.mount("none", "/", "none", MS_REC | MS_PRIVATE)
    root = os.path.join(folder, "root")
    os.mkdir(root)
    libc.mount("none", root, "tmpfs", MS_NOSUID | MS_NODEV, "size=1m,mode=755")
    for path in sorted({*trees, *DEVICES}):
        _bind(root, path, MS_BIND | MS_REC)
    _bind(root, folder, MS_BIND)  # without the new root, which lies in it
    for path in hidden:
        if os.path.isdir(root + path):
            libc.mount("none", root + path, "tmpfs", MS_RDONLY, "size=4k")
    for path in ("/proc", WRITABLE, "/.old"):
        os.makedirs(root + path, exist_ok=True)
    attributes = struct.pack("<QQQQ", ATTR_RDONLY | ATTR_NOSUID, 0, 0, 0)
    libc.syscall(
        syscalls.number("mount_setattr"),
        *(AT_FDCWD, ctypes.c_char_p(root.encode()), AT_RECURSIVE),
        *(ctypes.c_char_p(attributes), len(attributes)),
    )
    with contextlib.suppress(OSError):  # some containers forbid it; then it is empty
        quiet = MS_NOSUID | MS_NODEV | MS_NOEXEC
        libc.mount("none", root + "/proc", "proc", quiet)
    libc.mount("none", root + WRITABLE, "tmpfs", MS_NOSUID | MS_NODEV, SMALL)
    old = os.path.join(root, ".old")
    places = (ctypes.c_char_p(place.encode()) for place in (root, old))
    libc.syscall(syscalls.number("pivot_root"), *places)
    os.chdir("/")
    libc.detach("/.old")
    os.chdir(folder)


def _bind(root: str, path: str, flags: int) -> None:
    """Let a path be in the new root what it is, unless it is there by now."""
    if not os.path.lexists(path) or os.path.lexists(root + path):
        return
    os.makedirs(os.path.dirname(root + path), exist_ok=True)
    if os.path.islink(path):
        os.symlink(os.readlink(path), root + path)
        return
    if os.path.isdir(path):
        os.mkdir(root + path)
    else:
        os.close(os.open(root + path, os.O_CREAT))
    libc.mount(path, root + path, "none", flags)
