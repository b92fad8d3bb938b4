"""Calls of the C library that Python has no names for."""

import ctypes
import os
from typing import Final

PR_SET_PDEATHSIG: Final = 1
PR_SET_DUMPABLE: Final = 4
PR_SET_KEEPCAPS: Final = 8
PR_SET_NO_NEW_PRIVS: Final = 38

_libc = ctypes.CDLL(None, use_errno=True)


def check(result: int, what: str) -> int:
    """Raise `OSError` unless a call went well."""
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what}: {os.strerror(number)}")
    return result


def prctl(option: int, value: int) -> None:
    """Set an attribute of this process; raises `OSError`."""
    zero = ctypes.c_ulong(0)
    check(_libc.prctl(option, ctypes.c_ulong(value), zero, zero, zero), "prctl")


def syscall(number: int, *arguments: object) -> int:
    """Make a system call; raises `OSError`. Numbers are passed as longs."""
    given = [ctypes.c_long(a) if isinstance(a, int) else a for a in arguments]
    _libc.syscall.restype = ctypes.c_long
    return check(_libc.syscall(ctypes.c_long(number), *given), f"system call {number}")


def unshare(flags: int) -> None:
    """Leave namespaces; raises `OSError`."""
    check(_libc.unshare(flags), "unshare")


def mount(source: str, target: str, kind: str, flags: int, options: str = "") -> None:
    """Mount a file system; raises `OSError`."""
    texts = (text.encode() for text in (source, target, kind))
    done = _libc.mount(*texts, ctypes.c_ulong(flags), options.encode() or None)
    check(done, f"mount {target}")


def detach(target: str) -> None:
    """Take away what is mounted at a place; raises `OSError`."""
    MNT_DETACH = 2
    check(_libc.umount2(target.encode(), MNT_DETACH), f"umount {target}")
