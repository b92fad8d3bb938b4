"""Build a release folder from a manifest and a store, resumably and byte for byte.

Which rows go into which file is planned first. Every shard is written under a temporary
name, synced and renamed, and then noted with its checksum; a build that was killed
skips the shards that are noted and intact. The notes are removed with the last step.
"""

import json
import os
import shutil
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from mpmworlds.builder.plan.evaluation import Measured, with_measured
from mpmworlds.builder.plan.manifest import ManifestRow, read_manifest
from mpmworlds.builder.release.card import ConfigSize, card_text
from mpmworlds.builder.release.mpmworlds import MPMWorlds
from mpmworlds.builder.release.shards import (
    RECIPES,
    PlannedShard,
    ReleaseError,
    plan_shards,
)
from mpmworlds.builder.render.executors import results_of
from mpmworlds.builder.render.store import Store
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.checksums import (
    CHECKSUMS,
    files_below,
    read_checksums,
    sha256_of_file,
    write_checksums,
)
from mpmworlds.files.disk import disk_errors_named
from mpmworlds.files.locks import hold
from mpmworlds.files.targets import check_folder
from mpmworlds.splits.assign import SPLITS
from mpmworlds.splits.recorded_lists import write_lists

_NOTES: Final = ".build"
_PARTS: Final = ("data", "splits", "README.md", CHECKSUMS)  # of a release


@dataclass(frozen=True)
class WrittenShard:
    """What is noted of a finished shard."""

    key: str
    rows: int
    num_bytes: int
    file_size: int
    sha256: str


_ShardTask = tuple[MPMWorlds, PlannedShard, Path]


def build_release(
    manifest_path: Path,
    store: Store,
    out_dir: Path,
    configs: Mapping[str, Collection[str] | None],
    *,
    version: str,
    lists: Mapping[str, Sequence[str]] = MappingProxyType({}),
    measured: Collection[Measured] = (),
    rows_per_shard: int = 1000,
    workers: int = 1,
) -> list[PlannedShard]:
    """Write a release folder, or finish one that was interrupted.

    Parameters
    ----------
    manifest_path
        The manifest of all rows.
    store
        The rendered samples.
    out_dir
        Folder of the release. What a former build left there and this one does not
        write is removed.
    configs
        Configuration name -> ids of its rows, or None for all rows; the first one is
        the default of ``load_dataset``. ``recipes`` is added.
    version
        Version of the data, e.g. "1.0.0".
    lists
        Name -> ids of lists to publish beside those of the splits, such as the samples
        to evaluate on.
    measured
        What full runs of evaluation samples showed, which goes into their rows.
    rows_per_shard
        Most rows in a file.
    workers
        Number of processes. The bytes do not depend on it.

    Returns
    -------
    list of PlannedShard
        The files of rows that the release consists of.

    Raises
    ------
    ReleaseError
        If the request makes no sense, or the folder holds something else.
    NotRenderedError
        If the store lacks a row.
    DiskFullError
        If the disk is full. Nothing half-written stays behind.
    """
    rows = with_measured(read_manifest(manifest_path), measured)
    _check_splits(rows)
    plan = plan_shards(rows, configs, rows_per_shard)
    check_target(out_dir)
    out_dir.parent.mkdir(parents=True, exist_ok=True)
    lock = hold(out_dir.with_name(f".{out_dir.name}.lock"))
    if lock is None:
        raise ReleaseError(
            f"{out_dir}: another process is building it; wait for it, or name another "
            "folder"
        )
    with lock, disk_errors_named(out_dir):
        notes = _prepare(out_dir, plan)
        written = _write_shards(plan, store, out_dir, workers)
        by_split = {s: [row.id for row in rows if row.split == s] for s in SPLITS}
        write_lists(out_dir / "splits", {**lists, **by_split})
        chosen = {name: lists[name] for name in lists if name not in SPLITS}
        card = card_text(rows, _sizes(plan, written), version, chosen)
        write_atomically(out_dir / "README.md", card.encode())
        write_checksums(out_dir)
        shutil.rmtree(notes)
    return plan


def _check_splits(rows: Sequence[ManifestRow]) -> None:
    for row in rows:
        if row.split not in SPLITS:
            raise ReleaseError(
                f"{row.id}: split = {row.split!r}, must be one of {', '.join(SPLITS)}"
            )


def _prepare(out_dir: Path, plan: Sequence[PlannedShard]) -> Path:
    """Clear what a former build left; return the folder of this build's notes."""
    notes = out_dir / _NOTES
    check_target(out_dir)  # again, now that nobody else builds it
    notes.mkdir(parents=True, exist_ok=True)
    (out_dir / CHECKSUMS).unlink(missing_ok=True)  # not a release until it is finished
    planned = {shard.path for shard in plan}
    for name in files_below(out_dir):
        if name not in planned:
            (out_dir / name).unlink()
    for part in out_dir.rglob("*.part"):
        part.unlink()
    for shard in plan:
        for folder in (out_dir, notes):
            (folder / shard.path).parent.mkdir(parents=True, exist_ok=True)
    return notes


def check_target(out_dir: Path) -> None:
    """Raise `OSError` or `ReleaseError` unless a release can be built there."""
    check_folder(out_dir)
    if stranger := _stranger(out_dir):
        raise ReleaseError(
            f"{out_dir}: holds {stranger!r}, which is no part of a release; name an "
            "empty folder, for a build removes what a former one wrote"
        )


def _stranger(out_dir: Path) -> str | None:
    """A file or folder that no build has written."""
    entries = sorted(p.name for p in out_dir.iterdir()) if out_dir.is_dir() else []
    if not entries:
        return None
    if CHECKSUMS in entries:  # a release is finished
        known = read_checksums(out_dir)
        strangers = [name for name in files_below(out_dir) if name not in known]
        strangers += [] if "README.md" in known else [CHECKSUMS]
    else:  # one was begun
        known_entries = _PARTS if _NOTES in entries else ()
        strangers = [n for n in entries if n[0] != "." and n not in known_entries]
    return strangers[0] if strangers else None


def _write_shards(
    plan: Sequence[PlannedShard], store: Store, out_dir: Path, workers: int
) -> list[WrittenShard]:
    cache = str(out_dir / _NOTES / "cache")  # `datasets` locks a folder per builder
    builders = {
        config: MPMWorlds(
            config_name=config,
            store=None if config == RECIPES else store.root,
            cache_dir=cache,
        )
        for config in dict.fromkeys(shard.config for shard in plan)
    }
    tasks = [(builders[shard.config], shard, out_dir) for shard in plan]
    return results_of(
        _write_shard,
        tasks,
        lambda task: task[1].path,
        workers=workers,
        desc="build",
        unit="shard",
    )


def _write_shard(task: _ShardTask) -> WrittenShard:
    """Write one shard and its note, or find both done already."""
    builder, shard, out_dir = task
    path = out_dir / shard.path
    note = (out_dir / _NOTES / shard.path).with_suffix(".json")
    key = shard.key()
    found = _read_note(note)
    if found and found.key == key and path.is_file():
        if sha256_of_file(path) == found.sha256:
            return found
    part = note.with_suffix(".part")
    try:
        with disk_errors_named(path):
            rows, num_bytes = builder.write_shard(shard.rows, part)
            with part.open("rb") as stream:
                os.fsync(stream.fileno())
            digest = sha256_of_file(part)
            size = part.stat().st_size
            part.replace(path)
            written = WrittenShard(key, rows, num_bytes, size, digest)
            write_atomically(note, json.dumps(asdict(written)).encode())
    finally:
        part.unlink(missing_ok=True)
    return written


def _read_note(path: Path) -> WrittenShard | None:
    return WrittenShard(**json.loads(path.read_bytes())) if path.is_file() else None


def _sizes(
    plan: Iterable[PlannedShard], written: Iterable[WrittenShard]
) -> list[ConfigSize]:
    sizes: dict[str, ConfigSize] = {}
    for shard, found in zip(plan, written, strict=True):
        size = sizes.setdefault(
            shard.config, ConfigSize(shard.config, shard.config != RECIPES)
        )
        size.add(shard.split, found.rows, found.num_bytes, found.file_size)
    return list(sizes.values())
