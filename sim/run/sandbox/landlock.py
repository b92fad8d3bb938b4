"""Landlock: which files a process may read, and that it may write none.

By the kernel's documentation, Documentation/userspace-api/landlock.rst. What a kernel
does not know yet, by the version of its interface, is left out.
"""

import ctypes
import os
import struct
from collections.abc import Iterable
from typing import Final

from . import libc, syscalls

EXECUTE: Final = 1 << 0
READ_FILE: Final = 1 << 2
READ_DIR: Final = 1 << 3
READ: Final = EXECUTE | READ_FILE | READ_DIR
FIRST: Final = (1 << 13) - 1  # every right of the first version
LATER: Final = {2: 1 << 13, 3: 1 << 14, 5: 1 << 15}  # refer, truncate, ioctl of devices
NETWORK: Final = (4, (1 << 0) | (1 << 1))  # bind and connect of TCP
SCOPES: Final = (6, (1 << 0) | (1 << 1))  # abstract sockets and signals
VERSION: Final = 1  # flag: what is the version?
PATH_BENEATH: Final = 1


def version() -> int:
    """Version of the interface, 0 where there is none."""
    try:
        number = syscalls.number("landlock_create_ruleset")
        return libc.syscall(number, None, 0, VERSION)
    except (OSError, LookupError):
        return 0


def restrict(readable: Iterable[str], listable: Iterable[str]) -> int:
    """Forbid this thread, for ever, all files but those below some folders.

    Parameters
    ----------
    readable
        Files and folders that may be read, and executed as libraries are.
    listable
        Folders in which names may be looked up, but not read.

    Returns
    -------
    int
        Version of the interface; 0 if there is none, and nothing is forbidden.

    Raises
    ------
    OSError
        If the kernel refuses although it has the interface.
    """
    found = version()
    if not found:
        return 0
    rights = FIRST
    for since, right in LATER.items():
        rights |= right if found >= since else 0
    network = NETWORK[1] if found >= NETWORK[0] else 0
    scopes = SCOPES[1] if found >= SCOPES[0] else 0
    sizes = {1: 8, 2: 8, 3: 8, 4: 16, 5: 16}
    attributes = struct.pack("<QQQ", rights, network, scopes)[: sizes.get(found, 24)]
    rules = libc.syscall(
        syscalls.number("landlock_create_ruleset"), attributes, len(attributes), 0
    )
    for paths, allowed in ((readable, READ), (listable, READ_DIR)):
        for path in paths:
            _allow(rules, path, allowed)
    libc.syscall(syscalls.number("landlock_restrict_self"), rules, 0)
    os.close(rules)
    return found


def _allow(rules: int, path: str, allowed: int) -> None:
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except FileNotFoundError:
        return  # what is not there cannot be read
    if not os.path.isdir(path):
        allowed &= EXECUTE | READ_FILE
    rule = struct.pack("<Qi", allowed, place)
    number = syscalls.number("landlock_add_rule")
    libc.syscall(number, rules, PATH_BENEATH, ctypes.c_char_p(rule), 0)
    os.close(place)
