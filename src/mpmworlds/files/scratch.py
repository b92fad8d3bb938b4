"""Scratch folders that go with the process that made them, however it ends.

A process that is killed cannot tidy up, so the next one that makes a scratch folder
removes those whose makers are gone: nobody holds the file beside them any more.
"""

import errno
import os
import shutil
import tempfile
import time
import weakref
from contextlib import suppress
from pathlib import Path
from typing import Final

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.locks import Hold, hold

PREFIX: Final = "mpmworlds-"
_HELD: Final = ".held"
_PATIENCE: Final = 5.0  # seconds
_PASSING: Final = {errno.ENOTEMPTY, errno.EACCES, errno.EPERM}


class Scratch(Closeable):
    """A new folder, removed when it is closed, or no longer used.

    Attributes
    ----------
    path
        The folder.
    """

    def __init__(self) -> None:
        parent = Path(tempfile.gettempdir())
        _remove_abandoned(parent)
        held, self.path = _held_name(parent)
        self.path.mkdir(mode=0o700)
        self._end = weakref.finalize(self, _remove, self.path, held)

    def close(self) -> None:
        """Remove the folder."""
        self._end()


def _remove(folder: Path, held: Hold | None) -> None:
    """Remove a folder, whatever a program has made of it."""
    try:
        end = time.monotonic() + _PATIENCE
        while os.path.lexists(folder):
            try:
                if folder.is_symlink() or not folder.is_dir():
                    folder.unlink()
                else:
                    shutil.rmtree(folder)
            except FileNotFoundError:  # its process, which is being killed, was faster
                continue
            except OSError as error:
                # One that was killed may write while it dies, or has locked itself out.
                if error.errno not in _PASSING or time.monotonic() > end:
                    raise
                _unlock(folder)
                time.sleep(0.01)
    finally:
        if held:
            held.close()


def _unlock(path: Path) -> None:
    """Let the owner of a folder, and of those within it, into it."""
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            path.chmod(0o700)
            for inner in path.iterdir():
                _unlock(inner)


def _held_name(parent: Path) -> tuple[Hold | None, Path]:
    """Name for a folder, held unless the file system has no locks."""
    while True:
        descriptor, name = tempfile.mkstemp(_HELD, PREFIX, parent)
        os.close(descriptor)
        folder = Path(name.removesuffix(_HELD))
        try:
            held = hold(Path(name))
        except OSError:
            os.unlink(name)
            return None, folder
        if held and not folder.exists():  # else somebody thought it abandoned
            return held, folder


def _remove_abandoned(parent: Path) -> None:
    for file in sorted(parent.glob(f"{PREFIX}*{_HELD}")):
        try:
            mine = file.stat().st_uid == os.getuid()
            held = hold(file, create=False) if mine else None
        except OSError:  # it is gone, or there are no locks: then leave it alone
            continue
        if held is not None:
            shutil.rmtree(str(file).removesuffix(_HELD), ignore_errors=True)
            held.close()
