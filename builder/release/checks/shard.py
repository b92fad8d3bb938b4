"""One file of rows, read from its first byte to its last."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import pyarrow as pa

from mpmworlds.builder.release.checks.findings import RENDER, Finding, the_first
from mpmworlds.builder.release.checks.values import Row, value_faults
from mpmworlds.builder.release.checks.videos import preview_faults, video_faults
from mpmworlds.builder.release.features import columns_of, features_of, recipe_features
from mpmworlds.builder.release.layout import PREVIEW, RECIPES, Batch, Record
from mpmworlds.builder.release.rows import rendered_row
from mpmworlds.splits.uniform import uniform

LINKED: Final = 1000  # rows of a file of recipes whose programs are linked, about


@dataclass(frozen=True)
class Task:
    """A file to check."""

    root: Path
    """Folder of the release."""
    record: Record
    config: str
    split: str
    path: str
    """Inside the release."""
    rows: int
    """How many it should have."""
    seed: str
    """Decides, with the ids, of which recipes the programs are linked."""
    videos: bool
    """Whether to decode videos."""
    is_known: bool
    """Whether the rows are compared with those of the package, as a whole."""


@dataclass
class Report:
    """What is in a file.

    Its rows are told apart by number, since ids may repeat.
    """

    task: Task
    findings: list[Finding] = field(default_factory=list)
    batches: list[Batch] = field(default_factory=list)
    ids: list[str] = field(default_factory=list)
    recipes: dict[str, bytes] = field(default_factory=dict)
    """Id -> hash of what the manifest has of a row; not of known recipes."""
    contents: dict[str, dict[str, bytes]] = field(default_factory=dict)
    """Id -> column -> hash of what a program gave; of rendered rows."""
    good: list[tuple[str, Batch, int]] = field(default_factory=list)
    """Rendered rows without findings, and where they lie."""


def check_shard(task: Task) -> Report:
    """Check one file of a release row by row.

    A rendered row must link to its program. So must a recipe, but that takes some ten
    milliseconds each, and a release may have many more recipes than videos: of a large
    file about `LINKED` rows are linked, others by other seeds.
    """
    report = Report(task)
    report.findings += the_first(_findings(report), task.path)
    return report


def _findings(report: Report) -> Iterator[Finding]:
    task = report.task
    schema = features_of(task.config).arrow_schema
    try:
        with pa.memory_map(str(task.root / task.path)) as source:
            found = pa.ipc.read_schema(source)
            if found != schema:
                yield Finding(
                    task.path,
                    f"its columns or their types are not those of {task.config}: "
                    f"{', '.join(found.names)}",
                )
                return
            yield from _batch_findings(report, source, schema)
    except (OSError, ValueError, EOFError, MemoryError, pa.ArrowException) as error:
        yield Finding(task.path, f"cannot be read ({error})")
    if len(report.ids) != task.rows:
        yield Finding(
            task.path, f"has {len(report.ids)} rows, release.json says {task.rows}"
        )


def _batch_findings(
    report: Report, source: pa.MemoryMappedFile, schema: pa.Schema
) -> Iterator[Finding]:
    task = report.task
    share = LINKED / max(task.rows, 1) if task.config == RECIPES else 1.0
    while source.tell() < source.size():
        start = source.tell()
        try:
            message = pa.ipc.read_message(source)
        except EOFError:  # the mark at its end
            break
        size = source.tell() - start
        rows = pa.ipc.read_record_batch(message, schema)
        rows.validate(full=True)
        source.seek(start)
        digest = hashlib.sha256(source.read_buffer(size)).digest()
        ids = [str(name) for name in rows.column("id").to_pylist()]
        batch = Batch(start, size, digest, tuple(ids))
        report.batches.append(batch)
        report.ids += ids
        if task.is_known:
            continue
        for number, row in enumerate(rows.to_pylist()):
            faults = list(_row_faults(row, task, share))
            yield from (Finding(task.path, f, RENDER, ids[number]) for f in faults)
            _note(report, row, batch, number, not faults)
    if source.tell() < source.size():
        yield Finding(task.path, "has something behind its last row")


def _row_faults(row: Row, task: Task, share: float) -> Iterator[str]:
    is_linked = uniform(task.seed, "link", repr(row["id"])) <= share
    faults = list(value_faults(row, task.config, task.split, is_linked=is_linked))
    yield from faults
    if faults or not task.videos:  # what cannot be believed is not decoded
        return
    if "clip" in row:
        yield from video_faults(row)
    elif task.config == PREVIEW:
        corpus = task.record.configs[task.config].corpus
        yield from preview_faults(
            row, rendered_row(task.root, task.record, corpus, row["id"])
        )


def _note(report: Report, row: Row, batch: Batch, number: int, is_good: bool) -> None:
    """Keep of a row what it takes to compare it with others."""
    sample = str(row["id"])
    report.recipes[sample] = recipe_digest(row)
    if "clip" not in row:
        return
    names = {column.name for column in columns_of(report.task.config)}
    report.contents[sample] = {
        name: digest_of(row[name]) for name in sorted(names - set(recipe_features()))
    }
    if is_good:
        report.good.append((sample, batch, number))


def recipe_digest(row: Row) -> bytes:
    """Hash of what a row has of its manifest."""
    return digest_of(json.dumps([row[name] for name in recipe_features()]))


def digest_of(value: object) -> bytes:
    """Hash of a value of a column."""
    data = value.get("bytes") if isinstance(value, dict) else value
    whole = data if isinstance(data, bytes) else repr(data).encode()
    return hashlib.sha256(whole).digest()[:16]
