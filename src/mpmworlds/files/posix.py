"""What only POSIX systems have, and what is said where it is missing.

Releases can be read anywhere. Writing safely takes locks of the kernel (`fcntl`),
running programs takes limits (`resource`): without these nothing is tried.
"""

import errno
import sys
from importlib import import_module
from typing import Any, Final

MODULES: Final = ("fcntl", "resource")


class NotPosixError(OSError):
    """Something that is needed is not on this operating system."""

    def __init__(self, module: str) -> None:
        super().__init__(errno.ENOSYS, self._told(module))
        self.module = module

    @staticmethod
    def _told(module: str) -> str:
        return (
            f"this operating system ({sys.platform}) has no {module!r}, without which "
            "nothing is written or run: use Linux, or WSL on Windows; releases can be "
            "read here, by load_dataset and mpmworlds.load"
        )

    def __str__(self) -> str:
        """Return one line."""
        return self._told(self.module)


def needed(module: str) -> Any:
    """Import one of `MODULES`.

    Raises
    ------
    NotPosixError
        If this operating system has no such module.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError:
        raise NotPosixError(module) from None
