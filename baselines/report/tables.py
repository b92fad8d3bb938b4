"""The tables of a board: in the paper's form, by metric, and the ranking."""

from collections.abc import Iterable, Sequence
from typing import Final

from mpmworlds.baselines.report.board import Board, Coverage
from mpmworlds.baselines.report.numbers import KINDS, SCALES, Entry
from mpmworlds.baselines.report.paper import Paper, PaperRow
from mpmworlds.baselines.report.rank import Ranking
from mpmworlds.baselines.report.table import NONE, Group, Table
from mpmworlds.baselines.system import System
from mpmworlds.metrics import CONSTANTS, SCORED, Interval, Metric, Summary

ARROWS: Final = {"up": "↑", "down": "↓"}
SYSTEM_COLUMNS: Final = ("system", "regime", "evaluated", "valid", "failures")
NUMBERS_HEADER: Final = (
    *("config", "split", "system", "regime", "knows_answers", "evaluated"),
    *("expected", "complete", "compared", "valid", "failures"),
    *("metric", "direction", "scale"),
    *("summary", "mean", "sem", "n", "families", "low", "high"),
)

_INTERVALS: Final = f"No interval below {CONSTANTS.bootstrap_min_families} families."


def heading(metric: Metric) -> str:
    """Name of a metric over a column: the paper's, where it has one."""
    name = metric.paper_name or metric.name.replace("_", " ")
    return f"{name} {ARROWS[metric.direction]}"


def overview(
    board: Board, found: Sequence[Entry], scale: str, paper: Paper
) -> Table | None:
    """All metrics of all systems in the three summaries; None without ceilings."""
    if all(entry.summary(scale) is None for entry in found):
        return None
    groups = _summaries(board, found, scale)
    notes = [*board.warnings, _reading(board)]
    if scale == "raw":
        rows = paper.rows_for(board.split)
        told = f"{paper.title}, {paper.source}: other samples, for orientation only"
        groups.append(Group(told, tuple(map(_paper_row, rows))))
        notes += _paper_notes(rows)
    else:
        notes.append(
            "Beyond the noise ceiling: how much worse than a re-simulation from "
            "displaced particles, over the samples that have a ceiling; 0 is as good."
        )
    return Table(
        name=f"{_name(board)}-{scale}",
        title=f"{board.name}, all metrics, {SCALES[scale]}: mean ± standard error",
        columns=(*SYSTEM_COLUMNS, "n", *map(heading, SCORED.values())),
        groups=tuple(groups),
        texts=len(SYSTEM_COLUMNS),
        notes=tuple(notes),
    )


def by_metric(board: Board, found: Sequence[Entry]) -> list[Table]:
    """A table for each metric, with the intervals."""
    tables = []
    for metric in SCORED.values():
        mine = [entry for entry in found if entry.metric == metric]
        groups = [
            Group(title, tuple(_detail(entry, scale) for entry in mine))
            for scale, title in SCALES.items()
            if any(entry.summary(scale) for entry in mine)
        ]
        columns = [cell for title in KINDS.values() for cell in (title, "95 %", "n")]
        tables.append(
            Table(
                name=f"{_name(board)}-{metric.name.replace('_', '-')}",
                title=f"{board.name}, {heading(metric)} ({metric.name})",
                columns=(*SYSTEM_COLUMNS, *columns),
                groups=tuple(groups),
                texts=len(SYSTEM_COLUMNS),
                notes=(*board.warnings, _reading(board)),
            )
        )
    return tables


def ranking_table(board: Board, ranking: Ranking, found: Sequence[Entry]) -> Table:
    """The ranking with its intervals; one note, and no row, where there is none."""
    rows = []
    for place in ranking.places:
        mine = [entry for entry in found if entry.system is place.system]
        score, who = place.score, _who(place.system, mine)
        rows.append(
            (
                str(place.rank) if place.rank else NONE,
                *who[:2],
                number(score.mean),
                bounds(score),
                str(score.n),
                *who[2:],
            )
        )
    reading = (
        "Anchored score: 0 is copying the last frame, 1 the noise ceiling, failures at "
        "worst; over "
        + ", ".join(name for name, metric in SCORED.items() if metric.anchored)
        + "."
    )
    return Table(
        name=f"{_name(board)}-ranking",
        title=f"{board.name}, ranking by anchored score",
        columns=(
            *("rank", *SYSTEM_COLUMNS[:2], "score", "95 %", "n"),
            *SYSTEM_COLUMNS[2:],
        ),
        groups=(Group("", tuple(rows)),),
        texts=3,
        notes=(*board.warnings, ranking.missing or f"{reading} {_families(ranking)}"),
    )


def statements_table(paper: Paper) -> Table:
    """What else is known of the paper's results."""
    rows = [
        (
            told.about,
            told.value,
            "read from a figure by a third party" if told.read_from_figure else "text",
        )
        for told in paper.statements
    ]
    return Table(
        name="paper-statements",
        title=f"What else {paper.title} ({paper.source}) reports; other samples",
        columns=("of", "value", "how it is known"),
        groups=(Group("", tuple(rows)),),
        texts=3,
    )


def numbers_rows(board: Board, found: Iterable[Entry]) -> list[list[object]]:
    """Every number of a board with all its digits, for `NUMBERS_HEADER`."""
    rows: list[list[object]] = []
    for entry in found:
        origin, cover = entry.system.provenance, entry.coverage
        start = [
            *(board.config, board.split, entry.system.name, origin.regime),
            *(str(origin.knows_answers).lower(), cover.evaluated, cover.expected),
            *(str(cover.complete).lower(), cover.compared, cover.valid),
            failures_text([cover]),
            *(entry.metric.name, entry.metric.direction),
        ]
        for scale in SCALES:
            summary = entry.summary(scale)
            for kind in KINDS if summary else ():
                i: Interval = getattr(summary, kind)
                rows.append(
                    [*start, scale, kind, i.mean, i.sem, i.n, i.families, i.low, i.high]
                )
    return rows


def number(value: float | None) -> str:
    """A number as tables show it."""
    return NONE if value is None else f"{value:z.3f}"


def bounds(interval: Interval) -> str:
    """An interval as tables show it."""
    if interval.low is None or interval.high is None:
        return NONE
    return f"[{number(interval.low)}, {number(interval.high)}]"


def failures_text(covers: Sequence[Coverage]) -> str:
    """Failures by outcome; a range where metrics choose other candidates."""
    outcomes = sorted(set().union(*(cover.failures for cover in covers)))
    told = [
        f"{span([cover.failures.get(outcome, 0) for cover in covers])} {outcome}"
        for outcome in outcomes
    ]
    return ", ".join(told) or "none"


def _mean(interval: Interval) -> str:
    if interval.sem is None:
        return number(interval.mean)
    return f"{number(interval.mean)} ± {number(interval.sem)}"


def _who(system: System, found: Sequence[Entry]) -> tuple[str, ...]:
    """Cells for `SYSTEM_COLUMNS`."""
    covers = [entry.coverage for entry in found]
    valid = [cover.valid for cover in covers]
    share = [f"{cover.valid / cover.compared:.1%}" for cover in covers]
    low, high = (share[valid.index(end)] for end in (min(valid), max(valid)))
    answers = " (knows the answers)" if system.provenance.knows_answers else ""
    lacking = "" if covers[0].complete else " (incomplete)"
    return (
        system.name + answers + lacking,
        system.provenance.regime,
        f"{covers[0].evaluated}/{covers[0].expected}",
        f"{span(valid)} ({low if low == high else f'{low} to {high}'})",
        failures_text(covers),
    )


def span(counts: Sequence[int]) -> str:
    """Counts as tables show them: one number, or from the least to the greatest."""
    low, high = min(counts), max(counts)
    return str(low) if low == high else f"{low} to {high}"


def _summaries(board: Board, found: Sequence[Entry], scale: str) -> list[Group]:
    """The three summaries; those with the same rows, as without failures, at once."""
    titles: dict[tuple[tuple[str, ...], ...], list[str]] = {}
    for kind, title in KINDS.items():
        rows = tuple(_means(board, found, scale, kind))
        titles.setdefault(rows, []).append(title)
    return [Group(" = ".join(told), rows) for rows, told in titles.items()]


def _means(
    board: Board, found: Sequence[Entry], scale: str, kind: str
) -> Iterable[tuple[str, ...]]:
    for system in board.systems:
        mine = [entry for entry in found if entry.system is system]
        intervals = [_interval(entry.summary(scale), kind) for entry in mine]
        yield (
            *_who(system, mine),
            span([interval.n for interval in intervals]),
            *map(_mean, intervals),
        )


def _detail(entry: Entry, scale: str) -> tuple[str, ...]:
    intervals = [_interval(entry.summary(scale), kind) for kind in KINDS]
    cells = [cell for i in intervals for cell in (_mean(i), bounds(i), str(i.n))]
    return (*_who(entry.system, [entry]), *cells)


def _interval(summary: Summary | None, kind: str) -> Interval:
    if summary is None:  # no sample has a ceiling of this metric
        return Interval(None, None, 0, 0, None, None)
    found: Interval = getattr(summary, kind)
    return found


def _paper_row(row: PaperRow) -> tuple[str, ...]:
    values = (row.values.get(name) for name in SCORED)
    blank = (NONE,) * (len(SYSTEM_COLUMNS) - 1)
    return (f"paper: {row.system}", row.regime, *blank[1:], NONE, *map(number, values))


def _paper_notes(rows: Sequence[PaperRow]) -> list[str]:
    notes = []
    if any(row.split is None for row in rows):
        notes.append("Of which split the paper's rows are is not known.")
    notes += [
        f"Paper's {row.system}, {row.regime}"
        + (f", table {row.table}" if row.table else "")
        + f": {row.note}."
        for row in rows
        if row.note
    ]
    return notes


def _reading(board: Board) -> str:
    return (
        "Evaluated: samples with a result, of those in the split. Paired: over the "
        f"samples on which all {len(board.systems)} systems are valid. {_INTERVALS}"
    )


def _families(ranking: Ranking) -> str:
    counts = span([place.score.families for place in ranking.places])
    return f"The samples are of {counts} families. {_INTERVALS}"


def _name(board: Board) -> str:
    return f"{board.config}-{board.split}".replace("_", "-")
