"""Which rows there must be, in which order, and how files agree with each other."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mpmworlds.builder.parameters import EVALUATED, SHOWN
from mpmworlds.builder.release.checks.digests import digest_of
from mpmworlds.builder.release.checks.findings import RENDER, Finding, the_first
from mpmworlds.builder.release.checks.known import Known
from mpmworlds.builder.release.checks.shard import Report
from mpmworlds.builder.release.layout import (
    CLIPS,
    PREVIEW,
    RECIPES,
    SPLIT_LISTS,
    Record,
)
from mpmworlds.files.checksums import ChecksumError
from mpmworlds.splits.assign import SPLITS
from mpmworlds.splits.lists import EVALUATION
from mpmworlds.splits.recorded_lists import SplitListError, read_lists

Lists = Mapping[str, Sequence[str]]
_SWAPPED: Final = "rows or files were swapped; fetch or build the release again"


@dataclass(frozen=True)
class _Truth:
    """What the rows of a corpus are."""

    where: str
    places: Mapping[str, int]
    """Id -> place in its order."""
    digests: Mapping[str, bytes]
    """Id -> hash of its recipe, of rendered rows at least."""


def agreement_findings(
    root: Path, record: Record, reports: Sequence[Report], known: Mapping[str, Known]
) -> Iterator[Finding]:
    """Compare files with the lists, with the recipes, and with each other."""
    main = record.configs[RECIPES].corpus if RECIPES in record.configs else ""
    for corpus in sorted({config.corpus for config in record.configs.values()}):
        configs = [c for c in record.configs if record.configs[c].corpus == corpus]
        members = [report for report in reports if report.task.config in configs]
        folder = SPLIT_LISTS if corpus == main else f"{SPLIT_LISTS}/{corpus}"
        lists, findings = _lists(root, folder)
        yield from findings
        if corpus in known:
            yield from _known_list_findings(folder, lists, known[corpus])
        yield from _stray_findings(folder, lists, members, corpus == main)
        truth = _truth(members, known.get(corpus))
        for config in configs:
            files = [report for report in members if report.task.config == config]
            yield from the_first(_twice(files), f"data/{config}")
            for split in SPLITS:
                parts = [report for report in files if report.task.split == split]
                expected = _expected(config, corpus, split, lists)
                yield from the_first(
                    _membership(config, split, parts, expected), f"data/{config}"
                )
            if truth is not None:
                yield from the_first(_order(files, truth), f"data/{config}")
                yield from the_first(_recipes(files, truth), f"data/{config}")
        yield from the_first(_twins(members), "data")
        if corpus in known:
            yield from the_first(_frames(members, known[corpus]), "data")


def _lists(root: Path, folder: str) -> tuple[Lists, list[Finding]]:
    try:
        return read_lists(root / folder), []
    except FileNotFoundError:
        return {}, [Finding(folder, "its lists or their checksums are missing")]
    except (SplitListError, ChecksumError, OSError) as error:
        return {}, [Finding(folder, str(error))]


def _known_list_findings(folder: str, lists: Lists, known: Known) -> Iterator[Finding]:
    for name in sorted(lists.keys() | known.lists.keys()) if lists else ():
        if lists.get(name) != known.lists.get(name):
            yield Finding(
                f"{folder}/{name}.txt", "is not as this version of mpmworlds records it"
            )


def _stray_findings(
    folder: str, lists: Lists, reports: Sequence[Report], is_main: bool
) -> Iterator[Finding]:
    """Ids of lists that no row has."""
    if not is_main:
        return
    rows = {name for r in reports if r.task.config == RECIPES for name in r.ids}
    for name in sorted(lists.keys() - set(SPLITS)):
        for sample in sorted(set(lists[name]) - rows):
            yield Finding(f"{folder}/{name}.txt", f"{sample} is in no row of {RECIPES}")


def _truth(reports: Sequence[Report], known: Known | None) -> _Truth | None:
    rendered = {name for r in reports if r.task.config != RECIPES for name in r.recipes}
    if known is not None:
        digests = {name: known.recipe(name) for name in known.places.keys() & rendered}
        return _Truth("the corpus of this package", known.places, digests)
    recipes = [r for r in reports if r.task.config == RECIPES]
    if not recipes:
        return None
    order = [name for report in recipes for name in report.ids]
    places = {name: place for place, name in enumerate(order)}
    found = {
        name: report.recipes.get(name, b"") for report in recipes for name in report.ids
    }
    return _Truth(RECIPES, places, found)


def _twice(files: Sequence[Report]) -> Iterator[Finding]:
    seen: dict[str, str] = {}
    for report in files:
        for name in report.ids:
            if name in seen:
                yield Finding(
                    report.task.path, f"is there twice, also in {seen[name]}", row=name
                )
            seen[name] = report.task.path


def _expected(config: str, corpus: str, split: str, lists: Lists) -> set[str] | None:
    """Ids that a configuration must have of a split; None if nothing says it."""
    if not lists:
        return None
    base = SHOWN if config == PREVIEW else config.removesuffix(CLIPS)
    if base in (corpus, RECIPES):
        return set(lists.get(split, ()))
    names = {split: f"{base}_{split}" for split in SPLITS}
    if base == EVALUATED:
        names = dict(EVALUATION)
    if not any(name in lists for name in names.values()):
        return None
    return set(lists.get(names.get(split, ""), ()))


def _membership(
    config: str, split: str, parts: Sequence[Report], expected: set[str] | None
) -> Iterator[Finding]:
    if expected is None:
        return
    ids = {name: report.task.path for report in parts for name in report.ids}
    for name in sorted(expected - ids.keys()):
        yield Finding(
            f"data/{config}",
            f"is missing, the lists say that it is of {split}",
            row=name,
        )
    for name in sorted(ids.keys() - expected):
        yield Finding(
            ids[name], f"is there, but in no list of {config} and {split}", row=name
        )


def _order(files: Sequence[Report], truth: _Truth) -> Iterator[Finding]:
    last: dict[str, int] = {}
    for report in files:
        split = report.task.split
        for name in report.ids:
            place = truth.places.get(name)
            if place is None:
                yield Finding(report.task.path, f"is not in {truth.where}", row=name)
            elif place < last.get(split, -1):
                yield Finding(
                    report.task.path,
                    f"comes later than in {truth.where}",
                    _SWAPPED,
                    name,
                )
                last[split] = place
            else:
                last[split] = place


def _recipes(files: Sequence[Report], truth: _Truth) -> Iterator[Finding]:
    """Rows whose columns of the manifest are not those of the corpus."""
    for report in files:
        for name, digest in report.recipes.items():
            if name in truth.places and truth.digests.get(name) != digest:
                yield Finding(
                    report.task.path,
                    f"its recipe (id to program_sha256) is not that of {truth.where}",
                    RENDER,
                    name,
                )


def _twins(reports: Sequence[Report]) -> Iterator[Finding]:
    """Rows that say something else of the same sample than another configuration."""
    seen: dict[str, dict[str, tuple[bytes, str]]] = {}
    for report in reports:
        for sample, columns in report.contents.items():
            others = seen.setdefault(sample, {})
            for column, digest in columns.items():
                first, path = others.setdefault(column, (digest, report.task.path))
                if first != digest:
                    yield Finding(
                        report.task.path,
                        f"its {column} is not the one in {path}",
                        RENDER,
                        sample,
                    )


def _frames(reports: Sequence[Report], known: Known) -> Iterator[Finding]:
    """Videos that are not those whose hashes are recorded with the package."""
    for report in reports:
        for sample, columns in report.contents.items():
            recorded = known.frames.get(sample)
            if recorded and columns["frames_sha256"] != digest_of(recorded):
                yield Finding(
                    report.task.path,
                    "frames_sha256 is not what this version of mpmworlds records",
                    RENDER,
                    sample,
                )
