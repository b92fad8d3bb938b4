"""What comes with this package: rows, lists and hashes of videos of its own corpora."""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from mpmworlds.builder.parameters import Parameters
from mpmworlds.builder.plan.manifest import SCHEMA, recorded_manifest
from mpmworlds.builder.release.checks.digests import recipe_digest
from mpmworlds.builder.release.checks.findings import FETCH, Finding
from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import RECIPES, RECORD, Record
from mpmworlds.builder.release.shards import (
    Corpus,
    ReleaseError,
    corpus_key,
    plan_key,
    plan_shards,
)
from mpmworlds.builder.render.store import renderer
from mpmworlds.splits.recorded_lists import RECORDED, read_lists

_OTHER = f"it is not as this version of mpmworlds has recorded it; {FETCH}"


@dataclass(frozen=True)
class Known:
    """A corpus that comes with the package.

    Attributes
    ----------
    name
        Its name.
    rows
        All its rows, with what was measured.
    rows_per_shard
        Most rows in a file of a rendered configuration.
    """

    name: str
    rows: pa.Table
    rows_per_shard: int

    @cached_property
    def key(self) -> str:
        """Hash of its rows."""
        return corpus_key(self.rows)

    @cached_property
    def lists(self) -> Mapping[str, list[str]]:
        """Recorded lists of ids; empty if there are none."""
        folder = Path(str(RECORDED / self.name))
        return read_lists(folder) if folder.is_dir() else {}

    @cached_property
    def places(self) -> Mapping[str, int]:
        """Id -> number of its row."""
        return {name: k for k, name in enumerate(self.rows["id"].to_pylist())}

    def recipe(self, sample: str) -> bytes:
        """Hash of a row, as `recipe_digest` has it; empty if there is none."""
        if sample not in self.places:
            return b""
        (row,) = self.rows.slice(self.places[sample], 1).to_pylist()
        return recipe_digest(row)

    @cached_property
    def frames(self) -> Mapping[str, str]:
        """Id -> recorded hash of the frames of its video; empty if there are none."""
        file = files("mpmworlds.builder") / "recorded" / f"{self.name}.jsonl"
        lines = file.read_text("utf-8").splitlines() if file.is_file() else []
        records = [json.loads(line) for line in lines]
        return {record["id"]: record["frames_sha256"] for record in records}


def known_corpora(record: Record) -> dict[str, Known]:
    """Find which corpora of a release are those of this package, row by row."""
    params = Parameters.read()
    found = {}
    for name, digest in record.corpora.items():
        if record.version == params.version and name in params.data["profiles"]:
            known = known_corpus(name)
            if known is not None and known.key == digest:
                found[name] = known
    return found


@cache
def known_corpus(name: str) -> Known | None:
    """A corpus that comes with the package, read once; None if none is recorded."""
    params = Parameters.read()
    try:
        path = recorded_manifest(name)
    except LookupError:
        return None
    rows = Corpus(path, measured=params.measured_of(name)).rows()
    return Known(name, rows.combine_chunks(), params.rows_per_shard(name))


def known_recipe_findings(
    root: Path, record: Record, known: Known
) -> Iterator[Finding]:
    """Compare all recipes with the recorded ones: tables with tables, which is fast."""
    schema = features_of(RECIPES).arrow_schema
    expected = known.rows.cast(schema)
    places: dict[str, int] = {}
    parts: dict[str, pa.Table] = {}
    for file in record.configs[RECIPES].files:
        if file.split not in parts:
            chosen = pc.equal(expected["split"], file.split)
            parts[file.split] = expected.filter(chosen)
        start = places.get(file.split, 0)
        places[file.split] = start + file.rows
        wanted = parts[file.split].slice(start, file.rows)
        try:
            with pa.memory_map(str(root / file.path)) as source:
                found = pa.ipc.open_stream(source).read_all()
                found.validate(full=True)
        except (OSError, ValueError, pa.ArrowException):
            continue  # found already: the file cannot be read
        if found.schema == schema and not found.equals(wanted):
            yield from _row_findings(file.path, found, wanted)


def key_findings(
    record: Record, config: str, ids: Collection[str], known: Known
) -> Iterator[Finding]:
    """Work out the key by which a build knows what is there already."""
    if record.renderer != renderer():
        return  # the keys of another one are others
    try:
        plan = plan_shards(known.rows, {config: ids}, known.rows_per_shard)
    except ReleaseError:
        return  # ids that are not of the corpus were found already
    if plan_key(plan) != record.configs[config].key:
        yield Finding(
            RECORD,
            f"the key of {config} is not that of its rows",
            f"build {config} again",
        )


def _row_findings(path: str, found: pa.Table, wanted: pa.Table) -> Iterator[Finding]:
    said, ids = found["id"].to_pylist(), wanted["id"].to_pylist()
    if said != ids:
        place = next(
            (k for k, (a, b) in enumerate(zip(said, ids, strict=False)) if a != b),
            min(len(said), len(ids)),
        )
        here = repr(said[place]) if place < len(said) else "missing"
        there = repr(ids[place]) if place < len(ids) else "no row"
        yield Finding(path, f"row {place} is {here}, must be {there}; {_OTHER}")
        return
    for name in SCHEMA.names:
        if found[name].equals(wanted[name]):
            continue
        pairs = zip(found[name].to_pylist(), wanted[name].to_pylist(), strict=True)
        for sample, (here, there) in zip(ids, pairs, strict=True):
            if here != there:
                fault = f"{name} = {_brief(here)}, must be {_brief(there)}"
                yield Finding(path, fault, _OTHER, sample)


def _brief(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 100 else f"{text[:97]}..."
