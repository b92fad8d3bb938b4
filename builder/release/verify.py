"""Check a release against itself and against the functions that it is a cache of.

Nothing of a release is believed or executed: programs are linked anew from the scenes,
and what is simulated is what was linked here, in the sandbox.
"""

import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final, Literal, NamedTuple

from mpmworlds.builder.release.checks.agreement import agreement_findings
from mpmworlds.builder.release.checks.card import card_findings
from mpmworlds.builder.release.checks.files import look_at_files
from mpmworlds.builder.release.checks.findings import RENDER, Finding, the_first
from mpmworlds.builder.release.checks.indexes import index_findings
from mpmworlds.builder.release.checks.known import (
    Known,
    key_findings,
    known_corpora,
    known_recipe_findings,
)
from mpmworlds.builder.release.checks.media import MediaTask, check_media
from mpmworlds.builder.release.checks.shard import Report, Task, check_shard
from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import PREVIEW, RECIPES, Batch, Record
from mpmworlds.builder.release.rows import read_row
from mpmworlds.builder.release.tiers import bits_are_promised, tier_of
from mpmworlds.builder.render.executors import results_of
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.uniform import uniform

SMALL: Final = 200_000_000  # bytes: read sooner than a process has started


class Simulated(NamedTuple):
    """What came of simulating a row again."""

    path: str
    """File of the row, inside the release."""
    id: str
    tier: Literal["exact", "tolerance", "neither"]
    text: str
    """In words."""


@dataclass(frozen=True)
class Verified:
    """What was found.

    Attributes
    ----------
    findings
        What is not as it must be; empty if all is well.
    seed
        With it, the same rows are drawn again.
    simulated
        Rows that were simulated again, and how equal their videos are.
    recorded
        Corpora whose rows were compared with those that come with the package; those of
        the others were worked out from their scenes.
    videos
        Whether videos were decoded.
    """

    findings: tuple[Finding, ...]
    seed: str
    simulated: tuple[Simulated, ...]
    recorded: tuple[str, ...]
    videos: bool


class _Again(NamedTuple):
    """A row to simulate again."""

    root: Path
    path: str
    config: str
    id: str
    batch: Batch
    number: int


def verify_release(
    root: Path,
    resimulate: int = 1,
    workers: int = 1,
    *,
    seed: str | None = None,
    videos: bool = True,
) -> Verified:
    """Look for anything in a release that is not as it must be.

    Parameters
    ----------
    root
        Folder of the release.
    resimulate
        How many rows to simulate again and compare bit by bit, of those without
        findings.
    workers
        Number of processes, 0 for one per core.
    seed
        Draws the rows that are simulated again. Fresh randomness if None, so that
        nobody who changes a release knows which ones they will be.
    videos
        Whether to decode videos. Without, their bytes are held to the checksums alone,
        and nothing is simulated.

    Returns
    -------
    Verified
        The findings, and what was looked at.

    Raises
    ------
    FileNotFoundError
        If the folder has no SHA256SUMS: it is no release, or not finished.
    ValueError
        If `resimulate` is negative.
    SandboxError
        If rows are to be simulated again, and this machine cannot confine a program.
    """
    if resimulate < 0:
        raise ValueError(f"resimulate = {resimulate}, must be at least 0")
    if workers < 0:
        raise ValueError(f"workers = {workers}, must be >= 0 (0: one per core)")
    seed = secrets.token_hex(8) if seed is None else seed
    found = look_at_files(root, workers)
    findings = [*found.findings, *card_findings(root, found.record)]
    record = found.record
    if record is None:
        return Verified(tuple(findings), seed, (), (), videos)
    known = known_corpora(record)
    tasks = list(_tasks(root, record, found.digests, known, seed, videos))
    size = sum((root / task.path).stat().st_size for task in tasks)
    reports = results_of(
        check_shard,
        tasks,
        lambda task: task.path,
        workers=1 if size < SMALL else workers,
        desc="verify",
        unit="shard",
    )
    media = _media_findings(root, record, reports, workers) if videos else {}
    for report in reports:
        shown = media.get(report.task.path, [])
        findings += [*report.findings, *the_first(shown, report.task.path)]
    findings += _agreement(root, record, reports, known)
    simulated: list[Simulated] = []
    if videos and resimulate:
        drawn = _drawn(root, record, reports, findings, seed)[:resimulate]
        simulated = results_of(
            _simulate,
            drawn,
            lambda task: f"{task.path} {task.id}",
            workers=workers,
            desc="simulate",
            unit="row",
        )
        is_exact = bits_are_promised(record.renderer)
        findings += _tier_findings(simulated, is_exact)
    return Verified(
        tuple(findings), seed, tuple(simulated), tuple(sorted(known)), videos
    )


def _tasks(
    root: Path,
    record: Record,
    there: Mapping[str, str],
    known: Mapping[str, Known],
    seed: str,
    videos: bool,
) -> Iterator[Task]:
    seen = set()
    for name, config in record.configs.items():
        corpus = config.corpus if config.corpus in known else ""
        for file in config.files:
            if file.path not in there or file.path in seen:
                continue  # found already
            seen.add(file.path)
            quick = not videos
            yield Task(
                root, name, file.split, file.path, file.rows, seed, quick, corpus
            )


def _media_findings(
    root: Path, record: Record, reports: Sequence[Report], workers: int
) -> Mapping[str, list[Finding]]:
    """Path of each file -> what is wrong with videos of its good rows."""
    tasks = [
        MediaTask(
            root,
            record,
            report.task.config,
            report.task.path,
            batch,
            [number for _, _, number in good],
        )
        for report in reports
        for batch, good in groupby(report.good, key=lambda row: row[1])
    ]
    found: dict[str, list[Finding]] = {}
    each = results_of(
        check_media,
        tasks,
        lambda task: f"{task.path} byte {task.batch.offset}",
        workers=workers,
        desc="verify videos",
        unit="batch",
    )
    for task, findings in zip(tasks, each, strict=True):
        found.setdefault(task.path, []).extend(findings)
    return found


def _agreement(
    root: Path, record: Record, reports: Sequence[Report], known: Mapping[str, Known]
) -> Iterator[Finding]:
    recipes = record.configs.get(RECIPES)
    if recipes is not None and recipes.corpus in known:
        found = known_recipe_findings(root, record, known[recipes.corpus])
        yield from the_first(found, f"data/{RECIPES}")
    yield from agreement_findings(root, record, reports, known)
    for name in record.configs:
        files = [report for report in reports if report.task.config == name]
        yield from index_findings(root, name, files)
        corpus = known.get(record.configs[name].corpus)
        if corpus is not None and name != RECIPES:  # they were compared as they are
            ids = {sample for report in files for sample in report.ids}
            yield from key_findings(record, name, ids, corpus)


def _drawn(
    root: Path,
    record: Record,
    reports: Sequence[Report],
    findings: Sequence[Finding],
    seed: str,
) -> list[_Again]:
    """Rows without findings, in files without findings, in the order of a draw."""
    suspects = {finding.row for finding in findings}
    files = {finding.file for finding in findings if not finding.row}
    rows = {
        (record.configs[report.task.config].corpus, name): _Again(
            root, report.task.path, report.task.config, name, batch, number
        )
        for report in reports
        if report.task.path not in files and report.task.config != PREVIEW
        for name, batch, number in report.good
        if name not in suspects
    }
    order = sorted(rows, key=lambda key: uniform(seed, f"simulate {key[0]}", key[1]))
    return [rows[key] for key in order]


def _simulate(task: _Again) -> Simulated:
    schema = features_of(task.config).arrow_schema
    row = read_row(task.root / task.path, schema, task.batch, task.number)
    outcome = run(link(Scene.from_yaml(row["scene"], task.id)))
    if outcome.status != "ok":
        said = f"it ends in {outcome.status}: {outcome.message}"
        return Simulated(task.path, task.id, "neither", said)
    return Simulated(task.path, task.id, *tier_of(outcome.frames, row))


def _tier_findings(simulated: Sequence[Simulated], is_exact: bool) -> Iterator[Finding]:
    for found in simulated:
        if found.tier == "neither" or (is_exact and found.tier != "exact"):
            fault = f"simulated again, it gives another video here ({found.text})"
            yield Finding(found.path, fault, RENDER, found.id)
