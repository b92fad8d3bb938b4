"""Files of a release against SHA256SUMS and against its record."""

import os
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from mpmworlds.builder.release.checks.findings import FETCH, Finding
from mpmworlds.builder.release.layout import (
    RECIPES,
    RECORD,
    FileRecord,
    LayoutError,
    Record,
    index_path,
    read_record,
)
from mpmworlds.files.checksums import (
    CHECKSUMS,
    ChecksumError,
    files_below,
    read_checksums,
    sha256_of_file,
)
from mpmworlds.splits.assign import SPLITS

_RESTORE = f"restore it, or {FETCH}"


@dataclass(frozen=True)
class Found:
    """What a folder holds."""

    digests: Mapping[str, str]
    """Path inside of it -> sha256 of each file that can be read."""
    record: Record | None
    """What it says that it consists of; None if it does not."""
    findings: tuple[Finding, ...]
    """What is wrong with the files."""


def look_at_files(root: Path, workers: int) -> Found:
    """Hash all files of a release and hold them to its checksums and its record.

    Parameters
    ----------
    root
        Folder of the release.
    workers
        Number of threads, 0 for one per core.

    Raises
    ------
    FileNotFoundError
        If the folder has no SHA256SUMS: it is no release, or it is not finished.
    """
    findings = []
    try:
        sums = read_checksums(root)
    except ChecksumError as error:
        sums = {}
        findings.append(Finding(CHECKSUMS, _without(root, CHECKSUMS, error)))
    digests: dict[str, str] = {}
    names = files_below(root)
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        hashes = [pool.submit(sha256_of_file, root / name) for name in names]
        for name, digest in zip(names, hashes, strict=True):
            try:
                digests[name] = digest.result()
            except OSError as error:
                findings.append(Finding(name, f"cannot be read ({error.strerror})"))
    findings += _sum_findings(sums, digests)
    record = None
    try:
        record = read_record(root)
    except FileNotFoundError:
        findings.append(Finding(RECORD, "is missing", _RESTORE))
    except (LayoutError, OSError) as error:
        findings.append(Finding(RECORD, _without(root, RECORD, error)))
    if record is not None:
        findings += _record_findings(record, digests, root)
    return Found(digests, record, tuple(findings))


def _without(root: Path, name: str, error: Exception) -> str:
    """What an error says of a file, less the file's name and what to do."""
    said = str(error).removeprefix(f"{root / name}: ")
    return said.partition("; fetch")[0]


def _sum_findings(
    sums: Mapping[str, str], digests: Mapping[str, str]
) -> Iterator[Finding]:
    for name in sorted(sums):
        if name not in digests:
            yield Finding(name, f"is missing, {CHECKSUMS} names it")
        elif digests[name] != sums[name]:
            yield Finding(name, f"its sha256 is not the one in {CHECKSUMS}")
    for name in sorted(digests.keys() - sums.keys() if sums else ()):
        yield Finding(
            name, f"{CHECKSUMS} does not name it", f"take it away, or {FETCH}"
        )


def _record_findings(
    record: Record, digests: Mapping[str, str], root: Path
) -> Iterator[Finding]:
    for name in (record.default, RECIPES):
        if name not in record.configs:
            yield Finding(RECORD, f"has no configuration {name!r}")
    known = set()
    for name, config in record.configs.items():
        if config.corpus not in record.corpora:
            yield Finding(RECORD, f"{name} is of {config.corpus!r}, no corpus it names")
        expected = [path for path, _ in _numbered(name, config.files)]
        if [file.path for file in config.files] != expected:
            yield Finding(
                RECORD,
                f"files of {name} must be {', '.join(expected)}, in this order",
            )
        for file in config.files:
            known.add(file.path)
            yield from _file_findings(file, digests, root)
        known.add(index_path(name))
        if index_path(name) not in digests:
            yield Finding(index_path(name), "is missing", _RESTORE)
    for path in sorted(digests):
        of_rows = path.startswith("data/") or path.endswith(".arrow")
        if of_rows and path not in known:
            yield Finding(
                path, f"{RECORD} does not name it", f"take it away, or {FETCH}"
            )


def _file_findings(
    file: FileRecord, digests: Mapping[str, str], root: Path
) -> Iterator[Finding]:
    if file.path not in digests:
        yield Finding(file.path, f"is missing, {RECORD} names it")
        return
    if digests[file.path] != file.sha256:
        yield Finding(file.path, f"its sha256 is not the one in {RECORD}")
    if (size := (root / file.path).stat().st_size) != file.size:
        yield Finding(file.path, f"has {size} bytes, {RECORD} says {file.size}")


def _numbered(config: str, files: list[FileRecord]) -> Iterator[tuple[str, FileRecord]]:
    """Files of a configuration in order, by the names that they must have."""
    for split in (*SPLITS, *sorted({file.split for file in files} - set(SPLITS))):
        members = [file for file in files if file.split == split]
        for number, file in enumerate(members):
            name = f"{split}-{number:05d}-of-{len(members):05d}.arrow"
            yield f"data/{config}/{name}", file
