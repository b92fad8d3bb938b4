"""The folder of a gallery: its own, and gone on with after a stop."""

import json
from collections.abc import Collection, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from mpmworlds.files.atomic import PART, write_atomically
from mpmworlds.files.closeable import Closeable
from mpmworlds.files.journal import Journal
from mpmworlds.files.locks import remove_abandoned
from mpmworlds.files.targets import check_folder

MARK: Final = ".mpmworlds-gallery"
"""What marks the folder, and names the samples whose files are complete."""
PAGE: Final = "index.html"
INDEX: Final = ("data.js", "words.js")
FOLDERS: Final = ("previews", "samples", "videos")


class Site(Closeable):
    """A folder that a gallery is written to, by one process at a time.

    Parameters
    ----------
    root
        A new or empty folder, or one that holds a gallery.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    ValueError
        If it holds something else, or another process writes to it.
    """

    def __init__(self, root: Path) -> None:
        check_folder(root)
        mark = root / MARK
        if not mark.is_file() and root.is_dir() and any(root.iterdir()):
            raise ValueError(
                f"{root}: holds files that are no gallery; name a new folder, or an "
                "empty one"
            )
        self.root = root
        self._journal = Journal(mark)
        try:
            self._complete = self._read()
        except BaseException:
            self._journal.close()
            raise
        for folder in (root, *(root / name for name in FOLDERS)):
            for part in sorted(folder.glob(f".*{PART}")):
                remove_abandoned(part)

    def is_complete(self, sample: str, key: str, names: Collection[str]) -> bool:
        """Whether files of a sample are there, made of what has this key."""
        return self._complete.get(sample) == key and all(
            (self.root / name).is_file() for name in names
        )

    def begin(self, samples: Collection[str]) -> None:
        """Note that the files of some samples are about to be replaced."""
        stale = [name for name in samples if self._complete.pop(name, None)]
        self._journal.append("".join(_line(name, "") for name in stale))

    def complete(self, sample: str, key: str) -> None:
        """Note that the files of a sample are there."""
        self._journal.append(_line(sample, key))
        self._complete[sample] = key

    def finish(self, index: Mapping[str, bytes], names: Mapping[str, set[str]]) -> None:
        """Write the page, and remove what is of samples that it does not show.

        Parameters
        ----------
        index
            Name -> content of the files of `INDEX`.
        names
            Sample, in the order of the page -> names of its files.
        """
        for name, data in index.items():
            write_atomically(self.root / name, data)
        page = files(__package__).joinpath("page")
        for source in sorted(page.iterdir(), key=lambda file: file.name == PAGE):
            write_atomically(self.root / source.name, source.read_bytes())
        wanted = set[str]().union(*names.values())
        for folder in FOLDERS:
            _keep(self.root / folder, {n for n in wanted if n.startswith(folder)})
        lines = [_line(sample, self._complete[sample]) for sample in names]
        write_atomically(self.root / MARK, "".join(lines).encode())

    def close(self) -> None:
        """Let go of the folder."""
        self._journal.close()

    def _read(self) -> dict[str, str]:
        found, whole = {}, 0
        for number, line, end in self._journal.lines():
            whole = end
            try:
                record = json.loads(line)
                found[str(record["id"])] = str(record["key"])
            except (ValueError, TypeError, LookupError):
                raise ValueError(
                    f"{self._journal.path}: line {number} is none of a gallery; remove "
                    "the folder, or name another"
                ) from None
        self._journal.cut(whole)
        return found


def _keep(folder: Path, wanted: set[str]) -> None:
    """Remove the other files of a folder, and the folder if it is empty then."""
    if not folder.is_dir():
        return
    for path in sorted(folder.iterdir()):
        if f"{folder.name}/{path.name}" not in wanted:
            path.unlink()
    if not wanted:
        folder.rmdir()


def script(function: str, data: Any) -> bytes:
    """A script that calls a function of the page, which may load it from a disk."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return f"{function}({text});\n".encode()


def _line(sample: str, key: str) -> str:
    return json.dumps({"id": sample, "key": key}) + "\n"
