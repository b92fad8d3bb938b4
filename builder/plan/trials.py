"""Findings of trials by scene, so that no trial is ever run twice.

They are recorded in the repository: with them, a plan needs no simulation and does not
depend on the last bit of one. New ones go to a journal until they are recorded.
"""

import io
import json
from dataclasses import asdict, fields
from importlib.resources import files
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from mpmworlds.builder.plan.screen import Findings
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.journal import Journal

RECORDED: Final = Path(str(files("mpmworlds.builder") / "recorded" / "trials.parquet"))
TYPES: Final = {str: pa.string(), int: pa.int32(), float: pa.float64()}


def read_journal(path: Path) -> dict[str, Findings]:
    """Findings by key from a journal; a last line that was cut off does not count."""
    if not path.exists():
        return {}
    found = {}
    with Journal(path, wait=True) as journal:
        for _, line, _ in journal.lines():
            record = json.loads(line)
            key = record.pop("key")
            found[key] = Findings(**record)
    return found


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
    lines = [json.dumps({"key": key} | asdict(f)) + "\n" for key, f in found.items()]
    with Journal(path, wait=True) as journal:
        journal.cut(journal.end())
        journal.append("".join(lines))


def read_recorded(path: Path) -> dict[str, Findings]:
    """Findings by key from a recorded table; raises `FileNotFoundError`."""
    rows = pq.read_table(path).to_pylist()
    return {row.pop("key"): Findings(**row) for row in rows}


def write_recorded(path: Path, found: dict[str, Findings]) -> None:
    """Write findings as one table, sorted by key."""
    rows = [{"key": key} | asdict(found[key]) for key in sorted(found)]
    columns = [pa.field("key", pa.string())]
    columns += [pa.field(f.name, TYPES[f.type]) for f in fields(Findings)]  # type: ignore[index]
    table = pa.Table.from_pylist(rows, schema=pa.schema(columns))
    buffer = io.BytesIO()
    pq.write_table(table, buffer, compression="zstd")
    write_atomically(path, buffer.getvalue())
