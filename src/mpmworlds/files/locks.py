"""Files that last as long as the process that holds them.

A file is held while a process keeps it open and locked by ``flock``. The kernel lets go
when that process ends, in whatever way it ends. So whoever can lock such a file knows
that nobody alive holds it, whatever its age and whichever process made it.

A lock belongs to the file and not to its name. After locking one looks whether the name
still stands for that file: a previous holder may have removed it just before.
"""

import os
from pathlib import Path

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.posix import needed


class Hold(Closeable):
    """A held file; made by ``hold``.

    Attributes
    ----------
    path
        Its name.
    descriptor
        The open file, for reading and writing.
    """

    def __init__(self, path: Path, descriptor: int) -> None:
        self.path = path
        self.descriptor = descriptor

    def close(self) -> None:
        """Remove the file, if it still has its name, and let go of it."""
        try:
            self.path.unlink(missing_ok=True)
        finally:
            os.close(self.descriptor)


def hold(path: Path, *, create: bool = True) -> Hold | None:
    """Hold a file, unless somebody else does.

    Parameters
    ----------
    path
        Name of the file. Its folder must exist.
    create
        Make the file if it is not there.

    Returns
    -------
    Hold or None
        None if somebody alive holds the file, or if it is not there and not to be made.

    Raises
    ------
    OSError
        If the file cannot be opened, or its file system, or this system, has no locks.
    """
    fcntl = needed("fcntl")
    flags = os.O_RDWR | (os.O_CREAT if create else 0)
    while True:
        try:
            descriptor = os.open(path, flags, 0o666)
        except FileNotFoundError:
            if create:
                raise
            return None
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_named(path, descriptor):
                return Hold(path, descriptor)
        except BlockingIOError:
            os.close(descriptor)
            return None
        except OSError as error:
            os.close(descriptor)
            raise OSError(
                error.errno, f"no lock: {error.strerror}", str(path)
            ) from None
        os.close(descriptor)


def _is_named(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def remove_abandoned(path: Path) -> bool:
    """Remove a file that nobody alive holds.

    Parameters
    ----------
    path
        A file that is only ever used while it is held.

    Returns
    -------
    bool
        Whether it was removed. False if it is held, gone, or belongs to somebody else.
    """
    try:
        held = hold(path, create=False)
    except OSError:  # another user's, or no locks here: then leave it alone
        return False
    if held is None:
        return False
    held.close()
    return True
