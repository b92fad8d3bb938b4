"""Which rows go into which file of a release, decided before a file is written."""

import hashlib
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Final

from mpmworlds.builder.plan.manifest import ManifestRow
from mpmworlds.builder.release.mpmworlds import BATCH_ROWS, Shard
from mpmworlds.builder.render.store import renderer
from mpmworlds.splits.assign import SPLITS

RECIPES: Final = "recipes"  # the configuration of all rows, without program and video
RECIPES_PER_SHARD: Final = 50_000


class ReleaseError(ValueError):
    """A release that cannot be built as asked."""


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

    def key(self) -> str:
        """Return the hash of all that decides the file's bytes."""
        parts = [renderer(), BATCH_ROWS, self.config == RECIPES]
        record = json.dumps([parts, [asdict(row) for row in self.rows]])
        return hashlib.sha256(record.encode()).hexdigest()


def plan_shards(
    rows: Sequence[ManifestRow],
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
        All files, in order; the last ones are those of the configuration ``recipes``.

    Raises
    ------
    ReleaseError
        If a name or size is unusable, or an id is not in the manifest.
    """
    if rows_per_shard < 1:
        raise ReleaseError(f"rows_per_shard = {rows_per_shard}, must be at least 1")
    if RECIPES in configs or not configs:
        raise ReleaseError(
            f"configurations are {list(configs)}, must be at least one; {RECIPES!r} is "
            "added to every release and is not asked for"
        )
    known = {row.id for row in rows}
    plan: list[PlannedShard] = []
    for config, ids in configs.items():
        strangers = sorted(set(ids or ()) - known)
        if strangers:
            raise ReleaseError(
                f"configuration {config!r}: {strangers[0]} and {len(strangers) - 1} "
                "more ids are not in the manifest; draw the configuration again"
            )
        members = known if ids is None else set(ids)
        chosen = [row for row in rows if row.id in members]
        plan += _shards_of(config, chosen, rows_per_shard)
    return plan + list(_shards_of(RECIPES, rows, RECIPES_PER_SHARD))


def _shards_of(
    config: str, rows: Sequence[ManifestRow], per_shard: int
) -> Iterator[PlannedShard]:
    for split in SPLITS:
        members = [row for row in rows if row.split == split]
        count = -(-len(members) // per_shard)
        for number in range(count):
            chunk = members[number * per_shard : (number + 1) * per_shard]
            yield PlannedShard(config, split, number, count, tuple(chunk))
