"""The index of a configuration against its files."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa

from mpmworlds.builder.release.checks.findings import Finding
from mpmworlds.builder.release.checks.shard import Report
from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import Index, LayoutError, index_path


def index_findings(
    root: Path, config: str, reports: Sequence[Report]
) -> Iterator[Finding]:
    """Say where an index leads to other rows than it tells.

    Parameters
    ----------
    root
        Folder of the release.
    config
        Name of the configuration.
    reports
        What is in its files, in order.
    """
    path = index_path(config)
    if not (root / path).is_file():
        return  # found already
    try:
        index = Index((root / path).read_bytes(), path)
        index.table.validate(full=True)
        said = index.table.to_pylist()
    except (OSError, LayoutError, MemoryError, ValueError, pa.ArrowException) as error:
        text = str(error).removeprefix(f"{path}: ").partition("; fetch")[0]
        yield Finding(path, text)
        return
    if index.schema != features_of(config).arrow_schema:
        yield Finding(path, f"tells other columns than those of {config}")
    found = [
        {"path": report.task.path, "split": report.task.split} | vars(batch)
        for report in reports
        for batch in report.batches
    ]
    for number, (here, there) in enumerate(zip(said, found, strict=False)):
        wrong = [name for name in here if _plain(here[name]) != _plain(there[name])]
        if wrong:
            yield Finding(
                path,
                f"batch {number}, in {there['path']}: {_told(here, there, wrong[0])}",
            )
            return  # all that follow may be shifted
    if len(said) != len(found):
        yield Finding(path, f"tells of {len(said)} batches, there are {len(found)}")


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _told(here: dict[str, Any], there: dict[str, Any], name: str) -> str:
    if name == "sha256":
        return "its bytes are not those that the sha256 names"
    return f"{name} = {_plain(here[name])!r}, is {_plain(there[name])!r}"
