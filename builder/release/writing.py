"""Write the files of rows of a release beside it, each one noted when it is done."""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mpmworlds.builder.release.layout import RECIPES, Batch, FileRecord
from mpmworlds.builder.release.mpmworlds import MPMWorlds
from mpmworlds.builder.release.shards import PlannedShard
from mpmworlds.builder.render.executors import results_of
from mpmworlds.builder.render.store import Store
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.checksums import sha256_of_file
from mpmworlds.files.disk import disk_errors_named

NOTES: Final = ".build"


@dataclass(frozen=True)
class WrittenShard:
    """A finished file of rows.

    Attributes
    ----------
    file
        What it is.
    batches
        Where its rows lie in it.
    """

    file: FileRecord
    batches: tuple[Batch, ...]


_Task = tuple[MPMWorlds, PlannedShard, Path]


def write_shards(
    shards: Sequence[PlannedShard], store: Store, out_dir: Path, workers: int
) -> list[WrittenShard]:
    """Write files below the notes of a build, or find them done already.

    Parameters
    ----------
    shards
        What to write.
    store
        The rendered samples.
    out_dir
        Folder of the release. One that has its place there is not written again.
    workers
        Number of processes. The bytes do not depend on it.
    """
    cache = str(out_dir / NOTES / "cache")  # `datasets` locks a folder per builder
    builders = {
        config: MPMWorlds(
            config_name=config,
            store=None if config == RECIPES else store.root,
            cache_dir=cache,
        )
        for config in dict.fromkeys(shard.config for shard in shards)
    }
    tasks = [(builders[shard.config], shard, out_dir) for shard in shards]
    return results_of(
        _write_shard,
        tasks,
        lambda task: task[1].path,
        workers=workers,
        desc="build",
        unit="shard",
    )


def staged(out_dir: Path, path: str) -> Path:
    """Where a file of a release lies until all are there."""
    return out_dir / NOTES / path


def _write_shard(task: _Task) -> WrittenShard:
    builder, shard, out_dir = task
    path = staged(out_dir, shard.path)
    note = path.with_suffix(".json")
    key = shard.key
    found = _read_note(note, key)
    if found:
        for place in (path, out_dir / shard.path):
            if place.is_file() and sha256_of_file(place) == found.file.sha256:
                return found
    part = path.with_suffix(".part")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with disk_errors_named(path):
            num_bytes, batches = builder.write_shard(shard.rows, part)
            with part.open("rb") as stream:
                os.fsync(stream.fileno())
            file = FileRecord(
                path=shard.path,
                split=shard.split,
                rows=len(shard.rows),
                num_bytes=num_bytes,
                size=part.stat().st_size,
                sha256=sha256_of_file(part),
            )
            part.replace(path)
            written = WrittenShard(file, tuple(batches))
            write_atomically(note, _note(key, written))
    finally:
        part.unlink(missing_ok=True)
    return written


def _note(key: str, written: WrittenShard) -> bytes:
    batches = [[b.offset, b.size, b.sha256.hex(), b.ids] for b in written.batches]
    record = {"key": key, "file": written.file.model_dump(), "batches": batches}
    return json.dumps(record).encode()


def _read_note(path: Path, key: str) -> WrittenShard | None:
    """What is noted of a file with the same key, or None."""
    record = json.loads(path.read_bytes()) if path.is_file() else {}
    if record.get("key") != key:
        return None
    batches = tuple(
        Batch(offset, size, bytes.fromhex(digest), tuple(ids))
        for offset, size, digest, ids in record["batches"]
    )
    return WrittenShard(FileRecord(**record["file"]), batches)
