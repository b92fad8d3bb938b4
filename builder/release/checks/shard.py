"""One file of rows, read from its first byte to its last."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import pyarrow as pa

from mpmworlds.builder.plan.manifest import SCHEMA
from mpmworlds.builder.release.checks.digests import digest_of, recipe_digest
from mpmworlds.builder.release.checks.findings import RENDER, Finding, the_first
from mpmworlds.builder.release.checks.known import known_corpus
from mpmworlds.builder.release.checks.values import Depth, Row, value_faults
from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import RECIPES, Batch
from mpmworlds.splits.uniform import uniform

LINKED: Final = 1000  # rows of a file of recipes whose programs are linked, about


@dataclass(frozen=True)
class Task:
    """A file to check."""

    root: Path
    """Folder of the release."""
    config: str
    split: str
    path: str
    """Inside the release."""
    rows: int
    """How many it should have."""
    seed: str
    """Decides, with the ids, of which recipes the programs are linked."""
    quick: bool
    """Whether rows that are as the package has them need no linking."""
    corpus: str = ""
    """Corpus of the package that the rows are of; empty if it has none such."""


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
    """Rows with videos and without findings, and where they lie."""


def check_shard(task: Task) -> Report:
    """Check one file of a release row by row, all but what its videos show.

    A rendered row must link to its program. So must a recipe, but that takes some ten
    milliseconds each, and a release may have many more recipes than videos: of a large
    file about `LINKED` rows are linked, others by other seeds. In quick checks a row
    that is as the package has recorded it is not linked again: its program must have
    the recorded hash.
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
        if task.config == RECIPES and task.corpus:
            continue  # compared as a whole
        for number, row in enumerate(rows.to_pylist()):
            faults = list(_row_faults(row, task, share))
            yield from (Finding(task.path, f, RENDER, ids[number]) for f in faults)
            _note(report, row, batch, number, not faults)
    if source.tell() < source.size():
        yield Finding(task.path, "has something behind its last row")


def _row_faults(row: Row, task: Task, share: float) -> Iterator[str]:
    depth: Depth = "scene"
    if uniform(task.seed, "link", repr(row["id"])) > share:
        depth = "values"
    elif task.quick and task.corpus and _is_recorded(row, task.corpus):
        depth = "output"
    yield from value_faults(row, task.config, task.split, depth)


def _is_recorded(row: Row, corpus: str) -> bool:
    known = known_corpus(corpus)
    return known is not None and known.recipe(str(row["id"])) == recipe_digest(row)


def _note(report: Report, row: Row, batch: Batch, number: int, is_good: bool) -> None:
    """Keep of a row what it takes to compare it with others."""
    sample = str(row["id"])
    report.recipes[sample] = recipe_digest(row)
    if is_good and report.task.config != RECIPES:
        report.good.append((sample, batch, number))
    if "clip" not in row:
        return
    report.contents[sample] = {
        name: digest_of(row[name]) for name in sorted(row.keys() - set(SCHEMA.names))
    }
