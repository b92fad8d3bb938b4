"""Build a release folder from manifests and a store, resumably and byte for byte.

Which rows go into which file is planned first. Every file of rows is written beside
the release, in a folder of notes, synced, and noted with its checksum; a build that was
killed goes on from what is noted and intact. Only when all are there do they take their
places: until then a release that was there before stays as it was. Configurations that
are not asked for stay byte for byte.
"""

import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pyarrow as pa

from mpmworlds.builder.release.card import ConfigSize, card_text
from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import (
    CARD,
    RECIPES,
    RECORD,
    SPLIT_LISTS,
    ConfigRecord,
    Record,
    index_bytes,
    index_path,
    read_record,
)
from mpmworlds.builder.release.metadata import (
    CROISSANT,
    LEADERBOARD,
    write_metadata,
)
from mpmworlds.builder.release.shards import (
    Corpus,
    PlannedShard,
    ReleaseError,
    corpus_key,
    plan_key,
    plan_shards,
)
from mpmworlds.builder.release.writing import (
    NOTES,
    WrittenShard,
    staged,
    write_shards,
)
from mpmworlds.builder.render.store import Store, renderer
from mpmworlds.files.atomic import PART, write_atomically
from mpmworlds.files.checksums import (
    CHECKSUMS,
    files_below,
    read_checksums,
    write_checksums,
)
from mpmworlds.files.disk import disk_errors_named
from mpmworlds.files.locks import hold
from mpmworlds.files.targets import check_folder
from mpmworlds.splits.assign import SPLITS
from mpmworlds.splits.recorded_lists import write_lists

_MARK: Final = "mpmworlds"  # file among the notes: the folder is ours
_PARTS: Final = (  # of a release
    "data",
    SPLIT_LISTS,
    CARD,
    CHECKSUMS,
    CROISSANT,
    LEADERBOARD,
    RECORD,
)

Plans = dict[str, list[PlannedShard]]  # of each configuration


@dataclass(frozen=True)
class Built:
    """What became of the configurations of a release.

    Attributes
    ----------
    record
        What the release consists of.
    added, replaced, unchanged, kept
        Names: new, written anew with other content, asked for and there already, not
        asked for.
    """

    record: Record
    added: tuple[str, ...]
    replaced: tuple[str, ...]
    unchanged: tuple[str, ...]
    kept: tuple[str, ...]


def build_release(
    corpora: Sequence[Corpus],
    store: Store,
    out_dir: Path,
    *,
    version: str,
    workers: int = 1,
) -> Built:
    """Write a release folder, add to one, or finish what was interrupted.

    Parameters
    ----------
    corpora
        The corpora and their configurations. All rows of the first one are in the
        configuration ``recipes``, which is part of every release. The first of the
        configurations is the default of ``load_dataset`` in a new release.
    store
        The rendered samples.
    out_dir
        Folder of the release. A configuration of it that is not asked for stays as it
        is; one that is asked for is replaced.
    version
        Version of the data, e.g. "1.0.0".
    workers
        Number of processes. The bytes do not depend on it.

    Returns
    -------
    Built
        What the release consists of, and what was done.

    Raises
    ------
    ReleaseError
        If the request makes no sense, or the folder holds something else, or
        configurations that do not go with these.
    NotRenderedError
        If the store lacks a row.
    DiskFullError
        If the disk is full. Nothing half-written stays behind.
    """
    tables = {corpus.name: corpus.rows() for corpus in corpora}
    plans = _plan(corpora, tables)
    check_target(out_dir)
    out_dir.parent.mkdir(parents=True, exist_ok=True)
    lock = hold(out_dir.with_name(f".{out_dir.name}.lock"))
    if lock is None:
        raise ReleaseError(
            f"{out_dir}: another process is building it; wait for it, or name another "
            "folder"
        )
    with lock, disk_errors_named(out_dir):
        check_target(out_dir)  # again, now that nobody else builds it
        before = read_record(out_dir) if (out_dir / RECORD).is_file() else None
        there = before.configs if before else {}
        keys = {name: corpus_key(table) for name, table in tables.items()}
        kept = {name: there[name] for name in there if name not in plans}
        if before and kept:
            _check_kept(out_dir, before, kept, keys, version)
        _prepare(out_dir)
        asked = {config: plan_key(plan) for config, plan in plans.items()}
        unchanged = {
            name: there[name]
            for name, key in asked.items()
            if name in there and there[name].key == key and _whole(out_dir, there[name])
        }
        missing = [s for c in plans if c not in unchanged for s in plans[c]]
        written = write_shards(missing, store, out_dir, workers)
        configs = kept | unchanged | _records(corpora, asked, missing, written)
        record = Record(
            version=version,
            renderer=renderer(),
            default=before.default if before else next(iter(asked)),
            corpora=(before.corpora if before else {}) | keys,
            configs={name: configs[name] for name in _in_order([*there, *asked])},
        )
        _settle(out_dir, record, missing, written, corpora, tables)
    return Built(
        record,
        added=tuple(c for c in asked if c not in there),
        replaced=tuple(c for c in asked if c in there and c not in unchanged),
        unchanged=tuple(unchanged),
        kept=tuple(kept),
    )


def _plan(corpora: Sequence[Corpus], tables: Mapping[str, pa.Table]) -> Plans:
    names = [name for corpus in corpora for name in corpus.configs]
    if not names or RECIPES in names:
        raise ReleaseError(
            f"configurations are {names}, must be at least one; {RECIPES!r} is added "
            "to every release and is not asked for"
        )
    plans: Plans = {}
    for corpus in corpora:
        rows = tables[corpus.name]
        for shard in plan_shards(rows, corpus.configs, corpus.rows_per_shard):
            plans.setdefault(shard.config, []).append(shard)
    plans[RECIPES] = plan_shards(tables[corpora[0].name], {RECIPES: None}, 1)
    return plans


def _in_order(names: Iterable[str]) -> list[str]:
    """Configurations as they came, that of all rows last."""
    return sorted(dict.fromkeys(names), key=lambda name: name == RECIPES)


def _records(
    corpora: Sequence[Corpus],
    asked: Mapping[str, str],
    shards: Iterable[PlannedShard],
    written: Iterable[WrittenShard],
) -> dict[str, ConfigRecord]:
    corpus_of = {name: corpus.name for corpus in corpora for name in corpus.configs}
    corpus_of[RECIPES] = corpora[0].name
    found: dict[str, list[WrittenShard]] = {}
    for shard, one in zip(shards, written, strict=True):
        found.setdefault(shard.config, []).append(one)
    return {
        name: ConfigRecord(
            corpus=corpus_of[name], key=asked[name], files=[one.file for one in files]
        )
        for name, files in found.items()
    }


def _whole(out_dir: Path, config: ConfigRecord) -> bool:
    """Whether the files of a configuration are there; `verify` looks into them."""
    return all(
        (out_dir / f.path).is_file() and (out_dir / f.path).stat().st_size == f.size
        for f in config.files
    )


def _check_kept(
    out_dir: Path,
    before: Record,
    kept: Mapping[str, ConfigRecord],
    keys: Mapping[str, str],
    version: str,
) -> None:
    """Refuse to add to configurations which this build would contradict."""
    names = ", ".join(kept)
    main = before.configs[RECIPES].corpus
    if main not in keys or next(iter(keys)) != main:
        raise ReleaseError(
            f"{out_dir}: {RECIPES} has the rows of {main!r}, this build is of others; "
            "name another folder"
        )
    again = " ".join(f"--config {name}" for name in kept if name != RECIPES)
    for said, now in ((before.version, version), (before.renderer, renderer())):
        if said != now:
            raise ReleaseError(
                f"{out_dir}: has {names} of {said}, this build is of {now}; build them "
                f"again in the same command ({again}), or name another folder"
            )
    for name, config in kept.items():
        if keys.get(config.corpus, "") not in ("", before.corpora[config.corpus]):
            raise ReleaseError(
                f"{out_dir}: {name} is of another plan of {config.corpus!r} than this "
                f"build; build it again in the same command ({again}), or name another "
                "folder"
            )
        if not _whole(out_dir, config):
            raise ReleaseError(
                f"{out_dir}: {name} lacks files; build it again in the same command "
                f"({again})"
            )


def check_target(out_dir: Path) -> None:
    """Raise `OSError` or `ReleaseError` unless a release can be built there."""
    check_folder(out_dir)
    if stranger := _stranger(out_dir):
        raise ReleaseError(
            f"{out_dir}: holds {stranger!r}, which is no part of a release; name an "
            "empty folder, or one that a build has made"
        )


def _stranger(out_dir: Path) -> str | None:
    """A file or folder that no build has written."""
    entries = sorted(p.name for p in out_dir.iterdir()) if out_dir.is_dir() else []
    if not entries:
        return None
    if CHECKSUMS in entries:  # a release is finished
        known = read_checksums(out_dir)
        strangers = [name for name in files_below(out_dir) if name not in known]
        if RECORD not in known:
            strangers.append(CHECKSUMS)
        else:
            read_record(out_dir)  # raises if it is none of ours
    else:  # one was begun
        ours = (out_dir / NOTES / _MARK).is_file()
        strangers = [n for n in entries if not (ours and n in (*_PARTS, NOTES))]
    return strangers[0] if strangers else None


def _prepare(out_dir: Path) -> None:
    """Make the folder of notes."""
    notes = out_dir / NOTES
    write_atomically(
        notes / _MARK, b"Notes of a build of mpmworlds; it removes them.\n"
    )
    for part in sorted(notes.rglob("*.part")):
        part.unlink()


def _settle(
    out_dir: Path,
    record: Record,
    shards: Sequence[PlannedShard],
    written: Sequence[WrittenShard],
    corpora: Sequence[Corpus],
    tables: Mapping[str, pa.Table],
) -> None:
    """Put everything in its place. What is killed here goes on with the next build."""
    (out_dir / CHECKSUMS).unlink(missing_ok=True)  # no release until it is finished
    write_atomically(out_dir / RECORD, record.text().encode())
    for shard in shards:
        place = out_dir / shard.path
        place.parent.mkdir(parents=True, exist_ok=True)
        if (source := staged(out_dir, shard.path)).is_file():
            source.replace(place)
    for config in dict.fromkeys(shard.config for shard in shards):
        files = [
            (one.file, one.batches)
            for shard, one in zip(shards, written, strict=True)
            if shard.config == config
        ]
        index = index_bytes(features_of(config).arrow_schema, files)
        write_atomically(out_dir / index_path(config), index)
    _write_lists(out_dir / SPLIT_LISTS, corpora, tables)
    chosen = {n: i for n, i in corpora[0].lists.items() if n not in SPLITS}
    card = card_text(tables[corpora[0].name], _sizes(record), record, chosen)
    write_atomically(out_dir / CARD, card.encode())
    _remove_what_is_left(out_dir, record)
    known = {file.path: file.sha256 for file in record.files()}
    write_metadata(out_dir, record, known)
    write_checksums(out_dir, known)
    shutil.rmtree(out_dir / NOTES)


def _write_lists(
    folder: Path, corpora: Sequence[Corpus], tables: Mapping[str, pa.Table]
) -> None:
    """Write the lists of the first corpus, and of each other into a folder of its."""
    for corpus in corpora:
        rows = tables[corpus.name]
        ids, splits = rows["id"].to_pylist(), rows["split"].to_pylist()
        by_split: dict[str, list[str]] = {split: [] for split in SPLITS}
        for sample, split in zip(ids, splits, strict=True):
            by_split[split].append(sample)
        place = folder if corpus is corpora[0] else folder / corpus.name
        write_lists(place, {**corpus.lists, **by_split})


def _remove_what_is_left(out_dir: Path, record: Record) -> None:
    """Remove files of configurations as they were, and parts of what was killed."""
    known = {file.path for file in record.files()}
    known |= {index_path(name) for name in record.configs}
    for name in files_below(out_dir):
        if name.startswith("data/") and name not in known:
            (out_dir / name).unlink()
    for part in sorted(out_dir.rglob(".*" + PART)):
        part.unlink()


def _sizes(record: Record) -> list[ConfigSize]:
    sizes = []
    names = sorted(record.configs, key=lambda name: name != record.default)
    for name in names:
        size = ConfigSize(name)
        for file in record.configs[name].files:
            size.add(file.split, file.rows, file.num_bytes, file.size)
        sizes.append(size)
    return sizes
