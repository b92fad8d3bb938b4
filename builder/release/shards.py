"""Which rows go into which file of a release, decided before a file is written."""

import hashlib
import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Final

import pyarrow as pa
import pyarrow.compute as pc

from mpmworlds.builder.plan.evaluation import Measured
from mpmworlds.builder.plan.manifest import SCHEMA, ManifestError, read_table
from mpmworlds.builder.release.layout import RECIPES
from mpmworlds.builder.release.mpmworlds import (
    BATCH_ROWS,
    RECIPE_BATCH_ROWS,
    Shard,
)
from mpmworlds.builder.render.store import renderer
from mpmworlds.splits.assign import SPLITS

RECIPES_PER_SHARD: Final = 50_000
_FORMAT: Final = (BATCH_ROWS, RECIPE_BATCH_ROWS)  # what else decides a file's bytes


class ReleaseError(ValueError):
    """A release that cannot be built as asked."""


@dataclass(frozen=True)
class Corpus:
    """A plan of scenes, and the configurations of it that are wanted.

    Attributes
    ----------
    manifest
        File of all its rows.
    configs
        Configuration name -> ids of its rows, or None for all rows.
    name
        Name of the corpus, as in ``params.yaml``.
    lists
        Name -> ids of lists to publish beside those of the splits, such as the samples
        to evaluate on.
    measured
        What full runs of evaluation samples showed, which goes into their rows.
    rows_per_shard
        Most rows in a file.
    """

    manifest: Path
    configs: Mapping[str, Collection[str] | None] = field(
        default_factory=lambda: MappingProxyType({})
    )
    name: str = "full"
    lists: Mapping[str, Collection[str]] = field(
        default_factory=lambda: MappingProxyType({})
    )
    measured: Collection[Measured] = ()
    rows_per_shard: int = 1000

    def rows(self) -> pa.Table:
        """Rows of the manifest, with what was measured.

        Raises
        ------
        ReleaseError
            If a row is of an unknown split, or an id occurs twice.
        """
        table = read_table(self.manifest)
        _check(table, self.manifest)
        return _with_measured(table, self.measured)


@dataclass(frozen=True)
class PlannedShard:
    """One file of a release and the rows that it holds."""

    config: str
    split: str
    number: int
    count: int
    rows: Shard

    @property
    def path(self) -> str:
        """Path of the file inside the release."""
        name = f"{self.split}-{self.number:05d}-of-{self.count:05d}.arrow"
        return f"data/{self.config}/{name}"

    @cached_property
    def key(self) -> str:
        """Hash of all that decides the file's bytes."""
        parts = (renderer(), _FORMAT, self.config)
        digest = hashlib.sha256(repr(parts).encode())
        digest.update(_bytes_of(self.rows))
        return digest.hexdigest()


def plan_shards(
    rows: pa.Table,
    configs: Mapping[str, Collection[str] | None],
    rows_per_shard: int,
) -> list[PlannedShard]:
    """Decide which rows go into which file.

    Parameters
    ----------
    rows
        The manifest.
    configs
        Configuration name -> ids of its rows, or None for all rows.
    rows_per_shard
        Most rows in a file of a rendered configuration.

    Returns
    -------
    list of PlannedShard
        All files, in order.

    Raises
    ------
    ReleaseError
        If a name or size is unusable, or an id is not in the manifest.
    """
    if rows_per_shard < 1:
        raise ReleaseError(f"rows_per_shard = {rows_per_shard}, must be at least 1")
    known = set(rows["id"].to_pylist())
    plan: list[PlannedShard] = []
    for config, ids in configs.items():
        strangers = sorted(set(ids or ()) - known)
        if strangers:
            raise ReleaseError(
                f"configuration {config!r}: {strangers[0]} and {len(strangers) - 1} "
                "more ids are not in the manifest; draw the configuration again"
            )
        chosen = rows if ids is None else _having(rows, "id", sorted(ids))
        most = RECIPES_PER_SHARD if config == RECIPES else rows_per_shard
        plan += _shards_of(config, chosen, most)
    return plan


def plan_key(plan: Iterable[PlannedShard]) -> str:
    """Hash of all that decides the bytes of a configuration."""
    keys = "\n".join(f"{shard.path} {shard.key}" for shard in plan)
    return hashlib.sha256(keys.encode()).hexdigest()


def corpus_key(rows: pa.Table) -> str:
    """Hash of the rows of a corpus."""
    return hashlib.sha256(_bytes_of(rows)).hexdigest()


def _shards_of(config: str, rows: pa.Table, per_shard: int) -> Iterator[PlannedShard]:
    for split in SPLITS:
        members = _having(rows, "split", [split])
        count = -(-len(members) // per_shard)
        for number in range(count):
            chunk = members.slice(number * per_shard, per_shard)
            yield PlannedShard(config, split, number, count, _copied(chunk))


def _having(rows: pa.Table, column: str, values: list[str]) -> pa.Table:
    return rows.filter(pc.is_in(rows[column], pa.array(values, pa.string())))


def _check(table: pa.Table, manifest: Path) -> None:
    wrong = pc.invert(pc.is_in(table["split"], pa.array(SPLITS)))
    for row in table.filter(wrong).slice(0, 1).select(["id", "split"]).to_pylist():
        raise ReleaseError(
            f"{row['id']}: split = {row['split']!r}, must be one of {', '.join(SPLITS)}"
        )
    if pc.count_distinct(table["id"]).as_py() != len(table):
        raise ManifestError(f"{manifest}: an id occurs twice, ids must be unique")


def _with_measured(table: pa.Table, found: Collection[Measured]) -> pa.Table:
    """Rows with what full runs of them showed."""
    by_id = {m.id: m for m in found if m.status == "ok"}
    among = pc.is_in(table["id"], pa.array(sorted(by_id), pa.string()))
    places = pc.indices_nonzero(among).to_pylist()
    names = ("motion", "ceiling")
    values = {name: table[name].to_pylist() for name in names} if places else {}
    ids, programs = table["id"], table["program_sha256"]
    for place in places:
        measured = by_id[ids[place].as_py()]
        if measured.program_sha256 == programs[place].as_py():
            for name in names:
                values[name][place] = getattr(measured, name)
    for name, column in values.items():
        at, kind = SCHEMA.get_field_index(name), SCHEMA.field(name)
        table = table.set_column(at, kind, pa.array(column, kind.type))
    return table


def _bytes_of(rows: pa.Table) -> bytes:
    """The rows as text: what lies in Arrow's memory where a value is null may vary."""
    return json.dumps(rows.to_pydict()).encode()


def _copied(rows: pa.Table) -> pa.Table:
    """Rows in memory of their own: a slice is sent to a process with all around it."""
    return rows.take(pa.array(range(len(rows)), pa.int64())).combine_chunks()
