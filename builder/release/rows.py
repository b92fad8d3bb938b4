"""Single rows of a release, by the index of their configuration."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyarrow as pa

from mpmworlds.builder.release.layout import (
    Batch,
    Index,
    LayoutError,
    Record,
    index_path,
    read_record,
)

Row = dict[str, Any]


def find_row(root: Path, config: str, sample: str) -> Row | None:
    """Read one row without reading the rest.

    Parameters
    ----------
    root
        Folder of the release.
    config
        Name of a configuration.
    sample
        Id of the row.

    Returns
    -------
    dict or None
        The row, or None if the configuration has none of this id.

    Raises
    ------
    OSError, ValueError
        If the index or the file is not there or not readable.
    """
    index, places = _index(root, config)
    if sample not in places:
        return None
    number, position = places[sample]
    path, batch = index.at(number)
    return read_row(root / path, index.schema, batch, position)


def read_row(path: Path, schema: pa.Schema, batch: Batch, position: int) -> Row:
    """Read a row of a batch.

    Raises
    ------
    OSError, ValueError
        If there is none.
    """
    return read_rows(path, schema, batch, [position])[0]


def read_rows(
    path: Path, schema: pa.Schema, batch: Batch, positions: Sequence[int]
) -> list[Row]:
    """Read some rows of a batch; raises as `read_row`."""
    try:
        with path.open("rb") as stream:
            stream.seek(batch.offset)
            data = pa.py_buffer(stream.read(batch.size))
        found = pa.ipc.read_record_batch(data, schema)
        found.validate(full=True)
        return [found.slice(k, 1).to_pylist()[0] for k in positions]
    except (EOFError, IndexError, pa.ArrowException, MemoryError) as error:
        raise LayoutError(
            f"{path}: has no readable rows {list(positions)} at byte {batch.offset} "
            f"({error}); fetch or build the release again"
        ) from None


def rendered_row(root: Path, record: Record, corpus: str, sample: str) -> Row | None:
    """Find a row with a clip among the configurations of a corpus."""
    for row in _rows(root, record, corpus, sample):
        if "clip" in row:
            return row
    return None


def any_row(root: Path, sample: str, config: str | None = None) -> tuple[str, Row]:
    """Find a row of a release, with a video if there is one.

    Parameters
    ----------
    root
        Folder of the release.
    sample
        Id of the row.
    config
        Name of a configuration; else all are searched, see `Record.in_order`.

    Returns
    -------
    tuple
        Name of the configuration, and the row.

    Raises
    ------
    LookupError
        If there is no such configuration or row.
    """
    record = read_record(root)
    if config is not None and config not in record.configs:
        raise LookupError(
            f"{root}: has no configuration {config!r}; it has "
            f"{', '.join(record.configs)}"
        )
    for name in record.in_order() if config is None else [config]:
        row = find_row(root, name, sample)
        if row is not None:
            return name, row
    raise LookupError(
        f"{root}: has no row {sample!r} in {config or 'any configuration'}; "
        "`mpmworlds stats` says what the corpus has"
    )


def namesakes(root: Path, sample: str, config: str) -> list[str]:
    """Configurations of other corpora with another sample of the same id."""
    others = read_record(root).of_other_corpora(config)
    return [name for name in others if sample in _index(root, name)[1]]


def _rows(root: Path, record: Record, corpus: str, sample: str) -> Iterator[Row]:
    for name, config in record.configs.items():
        if config.corpus == corpus:
            try:
                row = find_row(root, name, sample)
            except (OSError, ValueError):  # a finding of its own
                continue
            if row is not None:
                yield row


def _index(root: Path, config: str) -> tuple[Index, dict[str, tuple[int, int]]]:
    path = root / index_path(config)
    found = path.stat()
    return _index_of(path, found.st_mtime_ns, found.st_size)


@lru_cache(16)
def _index_of(
    path: Path, _changed: int, _size: int
) -> tuple[Index, dict[str, tuple[int, int]]]:
    """The index in a file, read once for each version of it."""
    index = Index(path.read_bytes(), str(path))
    return index, index.places()
