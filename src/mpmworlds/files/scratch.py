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
from pathlib import Path
from typing import Final

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.locks import Hold, hold

PREFIX: Final = "mpmworlds-"
_HELD: Final = ".held"
_PATIENCE: Final = 5.0  # seconds


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
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            shutil.rmtree(folder)
            break
        except OSError as error:  # a process that was killed may write while it dies
            if error.errno != errno.ENOTEMPTY or time.monotonic() > end:
                raise
            time.sleep(0.01)
    if held:
        held.close()


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
