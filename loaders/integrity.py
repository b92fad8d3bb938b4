"""Check the files of a local release against SHA256SUMS before they are used.

``datasets`` compares row counts only: a flipped bit or two swapped files pass. Every
file is hashed once; after that its size and modification time vouch for it.
"""

import hashlib
import json
import logging
import os
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.checksums import ChecksumError, read_checksums, sha256_of_file

_log = logging.getLogger(__name__)

Stamp = list[int | str]  # size, modification time [ns], SHA-256


def check_release(root: Path, names: Iterable[str] | None = None) -> None:
    """Raise unless files of a release are what its SHA256SUMS says.

    Parameters
    ----------
    root
        Folder of the release.
    names
        Paths inside the release to check; without them, all. A folder of the release
        may be missing as a whole (a partial download), a file of a folder may not.

    Raises
    ------
    ChecksumError
        If a file is missing or differs; names the first one and how many more.
    """
    sums = read_checksums(root)
    chosen = {name: sums[name] for name in sums if names is None or name in set(names)}
    record = _record_path(root)
    known = _read_record(record)
    problems = []
    checked = dict(known)
    for name in tqdm(chosen, desc="checksums", unit="file", delay=2, leave=False):
        path = root / name
        if path.is_file():
            stamp = _stamp(path, chosen[name])
            if known.get(name) == stamp:
                continue
            if sha256_of_file(path) == chosen[name]:
                checked[name] = stamp
            else:
                problems.append(f"{path}: its sha256 is not the one in SHA256SUMS")
        elif (root / PurePosixPath(name).parent).is_dir():
            problems.append(f"{path}: is missing, SHA256SUMS names it")
    if problems:
        more = f" (and {len(problems) - 1} more files)" if problems[1:] else ""
        raise ChecksumError(f"{problems[0]}{more}: fetch or build the release again")
    if checked != known:
        _write_record(record, checked)


def _stamp(path: Path, sha256: str) -> Stamp:
    status = path.stat()
    return [status.st_size, status.st_mtime_ns, sha256]


def cache_folder() -> Path:
    """Where the package keeps what it can make again."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "mpmworlds"


def _record_path(root: Path) -> Path:
    key = hashlib.sha256(str(root.resolve()).encode()).hexdigest()
    return cache_folder() / "checked" / f"{key}.json"


def _read_record(path: Path) -> dict[str, Stamp]:
    try:
        record = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}  # nothing is known: everything is hashed again
    return record if isinstance(record, dict) else {}


def _write_record(path: Path, record: dict[str, Stamp]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, json.dumps(record, sort_keys=True).encode())
    except OSError as error:
        _log.info("%s: not written (%s); files are hashed at each load", path, error)
