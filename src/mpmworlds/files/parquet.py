"""Tables as Parquet files: the same bytes for the same table."""

import io
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from mpmworlds.files.atomic import write_atomically


def write_parquet(path: Path, table: pa.Table, **options: Any) -> None:
    """Write a table at once or not at all, compressed by zstd.

    Parameters
    ----------
    path
        File to write.
    table
        What it is to hold.
    options
        More for `pyarrow.parquet.write_table`.
    """
    buffer = io.BytesIO()
    pq.write_table(table, buffer, compression="zstd", **options)
    write_atomically(path, buffer.getvalue())
