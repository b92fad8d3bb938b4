"""A seccomp filter: the system calls that a simulation needs, and no others.

A classic BPF program [linux/filter.h, linux/seccomp.h] over the number and the
arguments of a call. What it does not allow fails with EPERM, so that a program sees an
exception; calls of another architecture end the process.
"""

import ctypes
import errno
import os
import struct
from typing import Final

from . import libc, syscalls

ALLOW: Final = 0x7FFF0000
KILL: Final = 0x80000000
ERRNO: Final = 0x00050000
SET_MODE_FILTER: Final = 1
TSYNC: Final = 1  # all threads of the process
LOAD: Final = 0x20  # a word of the call's data
EQUAL, GREATER, ANY_BIT, RETURN, AND = 0x15, 0x35, 0x45, 0x06, 0x54
NUMBER_AT, ARCH_AT, ARGUMENTS_AT = 0, 4, 16  # offsets in struct seccomp_data
X32: Final = 0x40000000

CLONE_VM, CLONE_THREAD, CLONE_NEW = 0x100, 0x10000, 0x7E020000  # and all CLONE_NEW*
WRITES: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
TEMPORARY: Final = 0o20000000  # O_TMPFILE's own bit
TERMINAL: Final = (0x5401, 0x5413, 0x541B)  # TCGETS, TIOCGWINSZ, FIONREAD
FLAGS_OF_FILES: Final = (0, 1, 2, 3, 4, 5, 6, 7, 1030, 1032)  # of fcntl: no signals
NAMES: Final = (15, 16, 0x53564D41)  # PR_SET_NAME, PR_GET_NAME, PR_SET_VMA

Code = list[bytes]


def install() -> None:
    """Filter the calls of this process from now on; raises `OSError`, `LookupError`."""
    code = b"".join(program(os.getpid()))
    buffer = ctypes.create_string_buffer(code, len(code))
    filters = struct.pack("HxxxxxxP", len(code) // 8, ctypes.addressof(buffer))
    libc.syscall(
        syscalls.number("seccomp"), SET_MODE_FILTER, TSYNC, ctypes.c_char_p(filters)
    )


def program(pid: int) -> Code:
    """The filter, for a process of that number."""
    machine = syscalls.machine()
    if machine is None:
        raise LookupError("there is no list of system calls for this architecture")
    code = [_load(ARCH_AT), _if(EQUAL, machine.audit, 1, 0), _return(KILL)]
    code.append(_load(NUMBER_AT))
    if machine.x32:
        code += [_if(GREATER, X32, 0, 1), _return(KILL)]
    for numbers in syscalls.ALLOWED.values():
        number = numbers[machine.column]
        if number is not None:
            code += [_if(EQUAL, number, 0, 1), _return(ALLOW)]
    for name, checks in _checks(pid).items():
        number = syscalls.FILTERED[name][machine.column]
        if number is not None:
            code += [_if(EQUAL, number, 0, len(checks)), *checks]
    code.append(_return(ERRNO | errno.EPERM))
    return code


def _checks(pid: int) -> dict[str, Code]:
    """What each filtered call must satisfy; each ends with a verdict."""
    forbidden = _return(ERRNO | errno.EPERM)
    missing = _return(ERRNO | errno.ENOSYS)  # the C library then takes an older call
    threads = [
        _load(_low(0)),
        _if(ANY_BIT, CLONE_NEW, 3, 0),
        _word(AND, CLONE_VM | CLONE_THREAD),
        _if(EQUAL, CLONE_VM | CLONE_THREAD, 0, 1),
        _return(ALLOW),
        forbidden,
    ]
    return {
        "clone": threads,
        "clone3": [missing],
        "open": _without(1, WRITES | TEMPORARY),
        "openat": _without(2, WRITES | TEMPORARY),
        "openat2": [missing],
        "kill": _equal(0, (pid,)),
        "tgkill": _equal(0, (pid,)),
        "prctl": _equal(0, NAMES),
        "ioctl": _equal(1, TERMINAL),
        "fcntl": _equal(1, FLAGS_OF_FILES),
        "prlimit64": [  # reading only: no new limit
            _load(_low(2)),
            _if(EQUAL, 0, 0, 3),
            _load(_low(2) + 4),
            _if(EQUAL, 0, 0, 1),
            _return(ALLOW),
            forbidden,
        ],
    }


def _without(argument: int, bits: int) -> Code:
    """Allow a call if an argument has none of some bits."""
    denied, allowed = _return(ERRNO | errno.EPERM), _return(ALLOW)
    return [_load(_low(argument)), _if(ANY_BIT, bits, 0, 1), denied, allowed]


def _equal(argument: int, values: tuple[int, ...]) -> Code:
    """Allow a call if an argument has one of some values."""
    code = [_load(_low(argument))]
    for value in values:
        code += [_if(EQUAL, value, 0, 1), _return(ALLOW)]
    return [*code, _return(ERRNO | errno.EPERM)]


def _low(argument: int) -> int:
    """Where the low half of an argument lies, on a little-endian machine."""
    return ARGUMENTS_AT + 8 * argument


def _load(offset: int) -> bytes:
    return _instruction(LOAD, 0, 0, offset)


def _word(operation: int, value: int) -> bytes:
    return _instruction(operation, 0, 0, value)


def _if(test: int, value: int, then: int, otherwise: int) -> bytes:
    """Compare, and pass over so many instructions."""
    return _instruction(test, then, otherwise, value)


def _return(verdict: int) -> bytes:
    return _instruction(RETURN, 0, 0, verdict)


def _instruction(code: int, then: int, otherwise: int, value: int) -> bytes:
    return struct.pack("HBBI", code, then, otherwise, value & 0xFFFFFFFF)
