"""Arrow or Parquet: the same rows in both, for what users do with them.

    python -m benchmarks.loading.formats RELEASE [--config mini] [--times 5]

Rows of a release are repeated, under other ids, into one file of each form. Times are
medians; bytes are those that a reader asks of the file, as it would of a server.
"""

import argparse
import io
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import datasets
import pyarrow as pa
import pyarrow.parquet as pq

TEXTS = ("id", "scene")


class Counted(io.FileIO):
    """A file that counts the bytes that are read."""

    count = 0

    def read(self, size: int = -1) -> bytes:
        """Read and count."""
        data = super().read(size)
        self.count += len(data)
        return data

    def readinto(self, buffer: Any) -> int:
        """Read and count."""
        size = super().readinto(buffer) or 0
        self.count += size
        return size


def main() -> None:
    """Print a line for each form."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("release", type=Path)
    parser.add_argument("--config", default="mini")
    parser.add_argument("--times", type=int, default=5)
    options = parser.parse_args()
    table = rows_of(options.release / "data" / options.config, options.times)
    print(f"{len(table)} rows, {table.nbytes / 1e6:.0f} MB")
    print(
        "form            MB  write    open  random  texts     MB  one row     MB  load"
    )
    print(
        "                    [MB/s]   [ms] [rows/s]  [ms]   read     [ms]   read   [s]"
    )
    with tempfile.TemporaryDirectory() as folder:
        for rows in (1, 4, 10):
            measure(f"arrow, {rows}", Arrow(Path(folder), rows), table)
        for rows in (1, 10, 100):
            measure(f"parquet, {rows}", Parquet(Path(folder), rows), table)


def rows_of(folder: Path, times: int) -> pa.Table:
    """Rows of a configuration, several times."""
    parts = [
        pa.ipc.open_stream(pa.memory_map(str(path))).read_all()
        for path in sorted(folder.glob("*.arrow"))
    ]
    table = pa.concat_tables(parts)
    ids = table["id"].to_pylist()
    copies = [
        table.set_column(
            0, table.schema.field("id"), pa.array([f"{i}-{k}" for i in ids])
        )
        for k in range(times)
    ]
    return pa.concat_tables(copies)


class Arrow:
    """A stream of record batches, mapped into memory."""

    def __init__(self, folder: Path, rows: int) -> None:
        self.path, self.rows = folder / f"{rows}.arrow", rows

    def write(self, table: pa.Table) -> None:
        """Write a table."""
        with pa.ipc.new_stream(str(self.path), table.schema) as writer:
            for start in range(0, len(table), self.rows):
                part = table.slice(start, self.rows).combine_chunks()
                writer.write_batch(part.to_batches()[0])

    def open(self) -> pa.Table:
        """The table, mapped."""
        return datasets.Dataset.from_file(str(self.path))

    def row(self, opened: Any, index: int) -> Any:
        """A row of what was opened."""
        return opened[index]

    def texts(self, file: Any) -> Any:
        """The columns of texts."""
        return pa.ipc.open_stream(file).read_all().select(TEXTS)

    def one(self, file: Any, index: int) -> Any:
        """A single row, by where its record batch lies."""
        start, size, schema = self.index[index // self.rows]
        file.seek(start)
        batch = pa.ipc.read_record_batch(pa.py_buffer(file.read(size)), schema)
        return batch.slice(index % self.rows, 1).to_pylist()

    def prepare(self) -> None:
        """Note where the record batches lie."""
        self.index = []
        with pa.memory_map(str(self.path)) as source:
            schema = pa.ipc.read_schema(source)
            while True:
                start = source.tell()
                try:
                    pa.ipc.read_message(source)
                except EOFError:
                    break
                self.index.append((start, source.tell() - start, schema))


class Parquet:
    """Row groups; videos as they are, all else compressed."""

    def __init__(self, folder: Path, rows: int) -> None:
        self.path, self.rows = folder / f"{rows}.parquet", rows

    def write(self, table: pa.Table) -> None:
        """Write a table."""
        kept = [n for n in table.schema.names if n not in ("video", "clip")]
        with pq.ParquetWriter(
            self.path,
            table.schema,
            compression=dict.fromkeys(kept, "zstd"),
            use_dictionary=False,
            write_statistics=["id"],
        ) as writer:
            for start in range(0, len(table), self.rows):
                writer.write_table(table.slice(start, self.rows))

    def open(self) -> Any:
        """The file, mapped."""
        return pq.ParquetFile(self.path, memory_map=True)

    def row(self, opened: Any, index: int) -> Any:
        """A row of what was opened."""
        group = opened.read_row_group(index // self.rows)
        return group.slice(index % self.rows, 1).to_pylist()

    def texts(self, file: Any) -> Any:
        """The columns of texts."""
        return pq.ParquetFile(file, pre_buffer=True).read(list(TEXTS))

    def one(self, file: Any, index: int) -> Any:
        """A single row, by the statistics in the footer."""
        opened = pq.ParquetFile(file)
        return self.row(opened, index)

    def prepare(self) -> None:
        """Nothing: the footer is the index."""


def measure(name: str, form: Any, table: pa.Table) -> None:
    """Write, open, read; print a line."""
    seconds = timed(lambda: form.write(table), 1)
    form.prepare()
    size = form.path.stat().st_size
    opening = timed(form.open)
    opened = form.open()
    indices = [(7919 * k) % len(table) for k in range(60)]
    random = timed(lambda: [form.row(opened, i) for i in indices])
    texts, texts_read = counted(form, form.texts)
    one, one_read = counted(form, lambda file: form.one(file, len(table) // 2))
    with tempfile.TemporaryDirectory() as cache:
        loading = timed(
            lambda: datasets.load_dataset(
                form.path.suffix[1:], data_files=str(form.path), cache_dir=cache
            ),
            1,
        )
    print(
        f"{name:12s} {size / 1e6:5.0f} {size / 1e6 / seconds:6.0f} "
        f"{1e3 * opening:7.1f} {len(indices) / random:7.0f} {1e3 * texts:6.1f} "
        f"{texts_read / 1e6:6.1f} {1e3 * one:8.1f} {one_read / 1e6:6.2f} {loading:6.1f}"
    )


def counted(form: Any, read: Callable[[Any], Any]) -> tuple[float, int]:
    """Seconds and bytes of a reading of a file."""
    sizes = []

    def reading() -> None:
        with Counted(str(form.path)) as file:
            read(file)
            sizes.append(file.count)

    return timed(reading), sizes[0]


def timed(do: Callable[[], Any], times: int = 5) -> float:
    """Median of the seconds that something takes."""
    found = []
    for _ in range(times):
        start = time.perf_counter()
        do()
        found.append(time.perf_counter() - start)
    return statistics.median(found)


if __name__ == "__main__":
    main()
