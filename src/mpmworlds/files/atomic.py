"""Files that are either absent, the old version, or the whole new version."""

import os
import secrets
from pathlib import Path
from typing import Final

from mpmworlds.files.disk import disk_errors_named
from mpmworlds.files.locks import Hold, hold

PART: Final = ".part"


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file's content in one step, also if the machine stops half-way.

    The new content goes into a hidden file ``.NAME.TOKEN.part`` beside it, which is
    held until it takes the name. One that a killed writer left behind is held by nobody
    (see ``mpmworlds.files.locks``) and may be removed.

    Parameters
    ----------
    path
        File to write. Its folder is made if there is none.
    data
        The whole new content.

    Raises
    ------
    DiskFullError
        If there is no room. The file stays as it was.
    """
    with disk_errors_named(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with _new_part(path) as part:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(part.descriptor, rest) :]
            os.fsync(part.descriptor)
            part.path.replace(path)
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)  # the new name, too, survives a power cut
    finally:
        os.close(folder)


def _new_part(path: Path) -> Hold:
    # A name per writer: numbers of processes repeat on another machine that shares the
    # folder. None is there only if a cleaner looks at the file before it is held.
    while True:
        part = hold(path.with_name(f".{path.name}.{secrets.token_hex(4)}{PART}"))
        if part is not None:
            return part
