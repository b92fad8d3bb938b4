"""Findings of trials by scene, so that no trial is ever run twice.

They are recorded in the repository: with them, a plan needs no simulation and does not
depend on the last bit of one. New ones go to a journal until they are recorded.
"""

from collections.abc import Iterable
from dataclasses import asdict, fields
from importlib.resources import files
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from mpmworlds.builder.plan.screen import Findings
from mpmworlds.files.journal import append_records, read_records
from mpmworlds.files.parquet import write_parquet

RECORDED: Final = tuple(  # of all corpora
    sorted(Path(str(files("mpmworlds.builder") / "recorded")).glob("*.trials.parquet"))
)
TYPES: Final = {str: pa.string(), int: pa.int32(), float: pa.float64()}


def read_journal(path: Path) -> dict[str, Findings]:
    """Findings by key from a journal; a last line that was cut off does not count."""
    return {record.pop("key"): Findings(**record) for record in read_records(path)}


def append_journal(path: Path, found: dict[str, Findings]) -> None:
    """Add findings to a journal, whole lines only, and see them to the disk.

    Parameters
    ----------
    path
        JSON Lines file. Made if it is not there.
    found
        Findings by key.

    Raises
    ------
    DiskFullError
        If there is no room; the journal stays as it was.
    """
    append_records(path, ({"key": key} | asdict(f) for key, f in found.items()))


def read_recorded(paths: Iterable[Path]) -> dict[str, Findings]:
    """Findings by key from recorded tables; raises `FileNotFoundError`."""
    rows = [row for path in paths for row in pq.read_table(path).to_pylist()]
    return {row.pop("key"): Findings(**row) for row in rows}


def write_recorded(path: Path, found: dict[str, Findings]) -> None:
    """Write findings as one table, sorted by key."""
    rows = [{"key": key} | asdict(found[key]) for key in sorted(found)]
    columns = [pa.field("key", pa.string())]
    columns += [pa.field(f.name, TYPES[f.type]) for f in fields(Findings)]  # type: ignore[index]
    table = pa.Table.from_pylist(rows, schema=pa.schema(columns))
    write_parquet(path, table)
