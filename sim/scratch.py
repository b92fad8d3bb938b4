"""Scratch folders that go with the process that made them, however it ends.

A process that is killed cannot tidy up, so the next one that makes a scratch folder
removes those whose makers are gone.
"""

import shutil
import tempfile
from pathlib import Path
from typing import Final

from mpmworlds.sim.closing import Closing
from mpmworlds.sim.locks import Hold, hold

PREFIX: Final = "mpmworlds-"
_HELD: Final = ".held"


class Scratch(Closing):
    """A new folder, removed when it is closed.

    Attributes
    ----------
    path
        The folder.
    """

    def __init__(self) -> None:
        _remove_abandoned()
        self._folder = tempfile.TemporaryDirectory(prefix=PREFIX)
        self.path = Path(self._folder.name)
        self._hold = _held(self.path)

    def close(self) -> None:
        """Remove the folder."""
        try:
            self._folder.cleanup()
        finally:
            self._hold.close()


def _held(folder: Path) -> Hold:
    """Hold a folder; what says so has its name only once it is locked."""
    new = folder / f"{_HELD}.new"
    held = hold(new)
    assert held is not None  # nobody else knows the folder
    new.rename(folder / _HELD)
    return held


def _remove_abandoned() -> None:
    for folder in sorted(Path(tempfile.gettempdir()).glob(f"{PREFIX}*")):
        if folder.is_symlink():
            continue
        try:
            held = hold(folder / _HELD, create=False)
        except OSError:  # another user's, or no locks here: then leave it alone
            continue
        if held is not None:
            shutil.rmtree(folder, ignore_errors=True)
            held.close()
