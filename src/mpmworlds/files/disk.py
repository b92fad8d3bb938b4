"""A full disk as one clear error, instead of an errno somewhere in a stack."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

_NO_ROOM: Final = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


class DiskFullError(OSError):
    """There is no room for a file; nothing half-written is left behind."""


@contextmanager
def disk_errors_named(path: Path) -> Iterator[None]:
    """Turn "no space left" and its relatives into ``DiskFullError``.

    Parameters
    ----------
    path
        What is being written, for the message if the error names no file itself.

    Raises
    ------
    DiskFullError
        If the block failed because the disk, a quota or a file size limit is exceeded.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in _NO_ROOM:
            raise
        raise DiskFullError(
            f"{error.filename or path}: no room to write it ({error.strerror}); free "
            "some space and run the same command again, what is finished is kept"
        ) from error
