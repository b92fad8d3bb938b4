"""Whether a file or folder can be written or read, asked before any work."""

import os
from pathlib import Path


def check_file(path: Path | None) -> None:
    """Raise `OSError` unless a file can be written there, or it is None."""
    if path is None:
        return
    if path.is_dir():
        raise IsADirectoryError(f"{path}: is a folder, must be a file; name another")
    check_folder(path.parent, path)


def check_folder(folder: Path, target: Path | None = None) -> None:
    """Raise `OSError` unless a folder is there to write into, or can be made.

    Parameters
    ----------
    folder
        The folder.
    target
        What is to be written, for the message; else the folder itself.
    """
    target = target or folder
    within = folder
    while not os.path.lexists(within) and within != within.parent:
        within = within.parent
    where = f"{target}: " if within == target else f"{target}: {within} "
    if not within.is_dir():
        raise NotADirectoryError(f"{where}is a file, must be a folder; name another")
    if not os.access(within, os.W_OK | os.X_OK, effective_ids=True):
        raise PermissionError(f"{where}is not to be written to by you; name another")


def refuse_file(folder: Path | str, what: str = "a release") -> None:
    """Raise `NotADirectoryError` if what must be the folder of something is a file."""
    if Path(folder).is_file():
        raise NotADirectoryError(
            f"{folder}: is a file, must be the folder of {what}; name that"
        )
