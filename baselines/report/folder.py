"""The folder of a report, in which nothing of an earlier report stays."""

from pathlib import Path, PurePosixPath
from typing import Final

from mpmworlds.files.atomic import write_atomically

LIST: Final = ".mpmworlds-report"
"""Names of the files that a report has written, one on each line."""


class Folder:
    """A folder that a report is written to.

    Each file is listed before it is written, so that the next report knows what to
    remove even if this one is stopped. What is not listed is not the report's, and
    stays.

    Parameters
    ----------
    root
        Where it is. Made when the first file is written.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._list = root / LIST
        self._listed = _names(self._list)
        self._written: set[str] = set()

    def write(self, name: str, data: bytes) -> None:
        """Write a file; its name is relative to the folder, with slashes."""
        if name not in self._listed:
            self.root.mkdir(parents=True, exist_ok=True)
            with self._list.open("a", encoding="utf-8") as stream:
                stream.write(f"{name}\n")
            self._listed.add(name)
        write_atomically(self.root / name, data)
        self._written.add(name)

    def finish(self) -> None:
        """Remove what an earlier report has written and this one has not."""
        for name in sorted(self._listed - self._written):
            path = self.root / name
            if path.is_file():
                path.unlink()
            _remove_empty(path.parent, self.root)
        self._listed = set(self._written)
        text = "".join(f"{name}\n" for name in sorted(self._written))
        write_atomically(self._list, text.encode())


def _names(path: Path) -> set[str]:
    """Names that a list holds, without those that lead out of its folder."""
    if not path.is_file():
        return set()
    names = map(PurePosixPath, path.read_text("utf-8").splitlines())
    return {
        name.as_posix()
        for name in names
        if name.parts and not name.is_absolute() and ".." not in name.parts
    }


def _remove_empty(folder: Path, root: Path) -> None:
    """Remove a folder and those that it is in, up to a root, as far as empty."""
    while folder != root and folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent
