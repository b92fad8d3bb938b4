"""SHA256SUMS of a folder tree, in the format of the ``sha256sum`` command."""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.targets import refuse_file
from mpmworlds.files.text import shown

CHECKSUMS = "SHA256SUMS"
_LINE = re.compile(r"([0-9a-f]{64})  (\S.*)", re.ASCII)


class ChecksumError(ValueError):
    """A file that is not the one that SHA256SUMS names."""


def sha256_of_file(path: Path) -> str:
    """Return the SHA-256 of a file's content, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def files_below(root: Path) -> list[str]:
    """Return the sorted relative paths of a tree's files, less SHA256SUMS itself.

    Hidden files and folders are left out: they are the business of tools (a Hub
    download adds ``.gitattributes`` and ``.cache``).
    """
    relative = (p.relative_to(root) for p in root.rglob("*") if p.is_file())
    return sorted(
        path.as_posix()
        for path in relative
        if str(path) != CHECKSUMS
        and not any(part.startswith(".") for part in path.parts)
    )


def write_checksums(
    root: Path, known: Mapping[str, str] = MappingProxyType({})
) -> None:
    """Write SHA256SUMS over all files of a tree, sorted by path.

    Parameters
    ----------
    root
        Folder whose files are listed and that gets the list.
    known
        Relative path -> SHA-256 of files that need not be read for it.
    """
    lines = [
        f"{known.get(name) or sha256_of_file(root / name)}  {name}\n"
        for name in files_below(root)
    ]
    write_atomically(root / CHECKSUMS, "".join(lines).encode())


def read_checksums(root: Path) -> dict[str, str]:
    """Read SHA256SUMS.

    Parameters
    ----------
    root
        Folder that holds the list.

    Returns
    -------
    dict
        Relative path -> SHA-256 in hexadecimal.

    Raises
    ------
    FileNotFoundError
        If there is no such list.
    ChecksumError
        If a line is no checksum line.
    """
    refuse_file(root)
    path = root / CHECKSUMS
    if not path.is_file():
        raise FileNotFoundError(
            f"{path}: is not there; name a folder that was built or downloaded whole"
        )
    sums = {}
    # What is no UTF-8 is in no line of ours.
    for line in path.read_text("utf-8", "backslashreplace").splitlines():
        match = _LINE.fullmatch(line)
        if match is None:
            raise ChecksumError(
                f"{path}: unreadable line '{shown(line, 100)}', must be "
                "'<sha256>  <path>'; fetch or build the release again"
            )
        sums[match[2]] = match[1]
    return sums
