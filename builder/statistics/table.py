"""The statistics of a corpus as text, beside the paper's."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

from mpmworlds.builder.statistics.counts import Statistics, Structures
from mpmworlds.builder.statistics.targets import (
    MIX,
    NOT_PUBLISHED,
    PAPER_COUNTS,
    PAPER_ORDER,
    TARGETS,
    verdicts,
)

Columns = Mapping[str, Statistics]
Cells = list[str]


def statistics_table(columns: Columns, structures: Structures) -> str:
    """Write statistics as a table, one column per part of the corpus.

    Parameters
    ----------
    columns
        Heading -> statistics. The first is the whole corpus, which is held to the
        targets; others are parts of it.
    structures
        Structures of its parents.

    Returns
    -------
    str
        Text of several lines.
    """
    whole = next(iter(columns.values()))
    sections = [
        _published(columns),
        _section("scenes by kind", columns, lambda s: s.kinds),
        _section("scenes by split", columns, lambda s: s.splits),
        _section("scenes with so many objects", columns, lambda s: s.num_objects),
        _section("scenes with so many materials", columns, lambda s: s.num_materials),
        _section("scenes with a material", columns, lambda s: s.materials),
        _section("scenes with an object type", columns, lambda s: s.object_types),
        _section("scenes made by an edit", columns, lambda s: s.edits),
        _matter(columns),
    ]
    tables = _aligned(sections)
    return "\n\n".join([*tables, _variety(structures), NOT_PUBLISHED, _targets(whole)])


def statistics_data(columns: Columns, structures: Structures) -> dict[str, Any]:
    """Return statistics as plain data, for programs.

    Parameters
    ----------
    columns, structures
        See `statistics_table`.

    Returns
    -------
    dict
        ``statistics`` by heading, ``structures``, what the ``paper`` publishes, and the
        ``targets`` with whether they hold.
    """
    whole = next(iter(columns.values()))
    paper = PAPER_COUNTS | {target.what: target.paper for target in TARGETS}
    return {
        "statistics": {heading: asdict(found) for heading, found in columns.items()},
        "structures": asdict(structures),
        "paper": paper | {"order of materials": PAPER_ORDER},
        "targets": [asdict(verdict) for verdict in verdicts(whole)],
    }


def _published(columns: Columns) -> list[Cells]:
    """What the paper publishes too, with its values in the last column."""
    rows = [["", *columns, "paper"]]
    for name, count in PAPER_COUNTS.items():
        counts = [f"{getattr(found, name):,}" for found in columns.values()]
        rows.append([name, *counts, f"{count:,}"])
    for target in TARGETS:
        values = [target.text(target.value(found)) for found in columns.values()]
        rows.append([target.what, *values, target.text(target.paper)])
    return rows


def _section(
    title: str,
    columns: Columns,
    counts_of: Callable[[Statistics], Mapping[Any, int]],
) -> list[Cells]:
    """Counts under a title; those of the whole corpus with their shares."""
    counts = [counts_of(found) for found in columns.values()]
    scenes = [found.scenes for found in columns.values()]
    rows = [[title, *[""] * len(counts), ""]]
    for key in counts[0]:
        shares = [
            f"{part.get(key, 0):,} {part.get(key, 0) / n:6.1%}"
            for part, n in zip(counts, scenes, strict=True)
        ]
        rows.append([f"  {key}", *shares, ""])
    return rows


def _matter(columns: Columns) -> list[Cells]:
    """Matter of templates by family, beside what was read from the paper's figure."""
    read = {mix.family: f"{mix.read:.1%}*" for mix in MIX}
    rows = [["matter of templates by family", *[""] * len(columns), ""]]
    for family in next(iter(columns.values())).matter:
        cells = [
            f"{found.matter.get(family, 0):,} {found.share(family):6.1%}"
            for found in columns.values()
        ]
        rows.append([f"  {family}", *cells, read.get(family, "")])
    return rows


def _aligned(sections: list[list[Cells]]) -> list[str]:
    """Sections as text, their columns below each other."""
    rows = [row for section in sections for row in section]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    texts = []
    for section in sections:
        lines = []
        for first, *others in section:
            cells = [first.ljust(widths[0])]
            cells += [c.rjust(w) for c, w in zip(others, widths[1:], strict=True)]
            lines.append("  ".join(cells).rstrip())
        texts.append("\n".join(lines))
    return texts


def _variety(found: Structures) -> str:
    if not found.parents:
        return "structures of parents: there are no parents"
    return (
        f"structures of parents: {found.distinct:,} distinct ones of {found.parents:,} "
        f"parents; {found.commonest_share:.1%} have the most frequent\n"
        f"  {found.commonest}"
    )


def _targets(whole: Statistics) -> str:
    lines = ["targets"]
    for verdict in verdicts(whole):
        word = "holds" if verdict.holds else "DOES NOT HOLD"
        lines.append(
            f"  {verdict.what}: {verdict.found}, must be {verdict.wanted}: {word}"
        )
    return "\n".join(lines)
