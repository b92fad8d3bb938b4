"""The figures of a board, in the paper's forms; the same bytes for the same numbers.

matplotlib is an extra: without it there are no figures, and the report says so.
"""

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from mpmworlds.baselines.report.board import Board
from mpmworlds.baselines.report.budgets import Spending, spendings
from mpmworlds.baselines.report.look import Look, looks
from mpmworlds.baselines.report.numbers import Entry
from mpmworlds.baselines.report.series import (
    AVERAGE,
    COLLAPSED,
    CURVED,
    Line,
    Point,
    by_family,
    lines,
    normalised,
    sensitivity,
)
from mpmworlds.baselines.report.tables import heading, span
from mpmworlds.metrics import METRICS, SCORED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GREY: Final = "#404040"
LETTER: Final = 0.075  # width of one [in], on average
FORMATS: Final = MappingProxyType(  # what keeps a date out of each
    {
        "png": {"Software": None},
        "svg": {"Date": None, "Creator": "mpmworlds"},
    }
)
STYLE: Final[Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib, so it is the same anywhere
    "font.size": 9.0,
    "axes.edgecolor": GREY,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "svg.hashsalt": "mpmworlds",
}
MISSING: Final = (
    "no figures, since matplotlib is missing: pip install 'mpmworlds[plots]'"
)

RIM: Final = "Where lines coincide, the lower ones show as a rim."
Draw = Callable[["Figure"], None]


def drawn(board: Board, found: Sequence[Entry]) -> Iterator[tuple[str, str, Draw]]:
    """Name, caption and drawing of every figure that there are numbers for."""
    scores = normalised(board, found)
    look = looks(board)
    if scores:
        caption = (
            "Means over valid samples; the last column is the normalised score, the "
            "mean of the seven metrics min-max scaled over the rows shown, up is good."
        )
        yield "heat", caption, partial(_heat, found=found, scores=scores, look=look)
    curves = lines(board)
    for name, metric, caption in (
        (
            "wmae",
            "wmae",
            "W-MAE over time: mean of valid samples ± standard error.",
        ),
        ("collapsed", COLLAPSED, "Share of valid samples with s(t) > 0.5 so far."),
    ):
        chosen = [line for line in curves if line.metric == metric]
        if chosen:
            yield name, f"{caption} {RIM}", partial(_single, some=chosen, look=look)
    if curves:
        caption = f"The metrics over time: means of the valid samples. {RIM}"
        yield "curves", caption, partial(_panels, curves=curves, look=look)
    points = by_family(board)
    if points:
        caption = (
            "By family of the materials in a sample: mean of the valid samples ± "
            "standard error, none of a single sample; a sample with several families "
            "is in each."
        )
        yield "families", caption, partial(_families, points=points, look=look)
    changes = sensitivity(board)
    if changes:
        caption = (
            "What not being told the materials changes, by family: no_materials "
            "against full_config on the same samples, up is good in every panel."
        )
        yield "sensitivity", caption, partial(_families, points=changes, look=look)
    spent = spendings(found)
    if spent:
        caption = (
            "Score over budget: means over all samples ± standard error, a failure at "
            "the worst value, by the minutes of one core that a sample may take."
        )
        yield "budget", caption, partial(_budgets, spent=spent, look=look)


def render(draw: Draw) -> dict[str, bytes]:
    """Draw a figure in each of `FORMATS`.

    Raises
    ------
    ModuleNotFoundError
        If matplotlib is not installed.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    data = {}
    with mpl.rc_context():  # whatever style the caller has chosen
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        for form, metadata in FORMATS.items():
            figure = Figure(dpi=120, layout="constrained")
            draw(figure)
            buffer = io.BytesIO()
            figure.savefig(buffer, format=form, metadata=metadata)
            data[form] = buffer.getvalue()
    return data


def _heat(
    figure: "Figure",
    found: Sequence[Entry],
    scores: dict[str, float],
    look: Mapping[str, Look],
) -> None:
    labels = sorted(scores, key=lambda label: (-scores[label], label))
    columns = [*METRICS.values()]
    means = {(e.system.label, e.metric.name): e.raw.valid.mean for e in found}
    names = [f"{look[label].name} ({_valid(found, label)})" for label in labels]
    width = 0.9 * (len(columns) + 1) + LETTER * max(map(len, names))
    figure.set_size_inches(width, 1.0 + 0.34 * len(labels))
    axes = figure.add_subplot()
    cells = [
        [*(_share(means, labels, label, m) for m in columns), scores[label]]
        for label in labels
    ]
    axes.imshow(cells, cmap="YlGnBu", vmin=0, vmax=1, aspect="auto")
    for row, label in enumerate(labels):
        values = [*(means[label, m.name] or 0.0 for m in columns), scores[label]]
        for column, value in enumerate(values):
            colour = "white" if cells[row][column] > 0.6 else "black"
            axes.text(
                column, row, f"{value:.3f}", ha="center", va="center", color=colour
            )
    axes.set_yticks(range(len(labels)), names)
    axes.set_xticks(range(len(columns) + 1), [*map(heading, columns), "normalised ↑"])
    axes.axvline(len(columns) - 0.5, color="white", linewidth=4)
    axes.tick_params(length=0, top=True, labeltop=True, bottom=False, labelbottom=False)
    axes.spines[:].set_visible(False)


def _valid(found: Sequence[Entry], label: str) -> str:
    """How many samples the means of a system are of."""
    covers = [entry.coverage for entry in found if entry.system.label == label]
    return f"n = {span([cover.valid for cover in covers])} of {covers[0].compared}"


def _share(means: Any, labels: Sequence[str], label: str, metric: Any) -> float:
    """How good a mean is among those shown: 0 the worst, 1 the best."""
    column = [means[other, metric.name] for other in labels]
    low, high = min(column), max(column)
    share = (means[label, metric.name] - low) / (high - low) if high > low else 0.5
    return float(share if metric.direction == "up" else 1 - share)


def _single(figure: "Figure", some: Sequence[Line], look: Mapping[str, Look]) -> None:
    axes = figure.add_subplot()
    for line in some:
        mine = look[line.system.label]
        _plot(axes, line, mine, label=f"{mine.name} (n = {line.n})")
        axes.fill_between(
            line.seconds,
            line.mean - line.sem,
            line.mean + line.sem,
            color=mine.colour,
            alpha=0.15,
            linewidth=0,
        )
    _time(axes)
    metric = some[0].metric
    axes.set_ylabel(heading(SCORED[metric]) if metric in SCORED else metric)
    _legend(figure, width=9.0, height=3.0)


def _panels(figure: "Figure", curves: Sequence[Line], look: Mapping[str, Look]) -> None:
    columns = 4
    rows = -(-len(CURVED) // columns)
    grid = figure.subplots(rows, columns)
    for axes, metric in zip(grid.flat, CURVED.values(), strict=False):
        for line in curves:
            if line.metric == metric.name:
                mine = look[line.system.label]
                label = f"{mine.name} (n = {line.n})"
                _plot(axes, line, mine, label if axes is grid.flat[0] else None)
        axes.set_title(heading(metric))
        _time(axes)
    for axes in list(grid.flat)[len(CURVED) :]:
        axes.set_visible(False)
    _legend(figure, width=12.0, height=2.4 * rows)


def _legend(figure: "Figure", width: float, height: float) -> None:
    """The legend below panels of a height [in], in as many columns as have room."""
    labels = [label for axes in figure.axes for label in _labels(axes)]
    columns = int(width / (0.9 + LETTER * max(map(len, labels), default=0))) or 1
    rows = -(-len(labels) // columns)
    figure.set_size_inches(width, height + 0.2 + 0.19 * rows)
    figure.legend(
        loc="outside lower center",
        ncols=columns,
        frameon=False,
        handlelength=4.0,  # as long as the longest dash is at the widest
    )


def _labels(axes: "Axes") -> list[str]:
    return axes.get_legend_handles_labels()[1]


def _plot(axes: "Axes", line: Line, look: Look, label: str | None) -> None:
    axes.plot(
        line.seconds,
        line.mean,
        color=look.colour,
        linestyle=(0, look.dash) if look.dash else "-",
        linewidth=look.width,
        label=label,
    )


def _time(axes: "Axes") -> None:
    """Time across, from its first value on, and values up, with room for a 0."""
    axes.set_xlabel("time in the video [s]")
    axes.margins(x=0)
    _, high = axes.get_ylim()
    axes.set_ylim(-0.04 * high, high)


def _families(
    figure: "Figure", points: Sequence[Point], look: Mapping[str, Look]
) -> None:
    """Dots with error bars: a panel for each metric, a row for each family."""
    shown = {point.system.label for point in points}
    seen = {label: mine for label, mine in look.items() if label in shown}
    families = sorted({point.family for point in points})
    names = [_counted(points, family) for family in families]
    metrics = [m for m in (*METRICS, AVERAGE) if any(p.metric == m for p in points)]
    grid = figure.subplots(2, 4, sharey=True)
    for axes, metric in zip(grid.flat, metrics, strict=False):
        for place, (label, mine) in enumerate(seen.items()):
            shift = (place - (len(seen) - 1) / 2) * 0.8 / len(seen)
            dots = [
                point
                for point in points
                if point.metric == metric
                and point.system.label == label
                and point.value.mean is not None
            ]
            axes.errorbar(
                [point.value.mean or 0.0 for point in dots],
                [families.index(point.family) + shift for point in dots],
                xerr=[point.value.sem or 0.0 for point in dots],
                fmt=mine.mark,
                color=mine.colour,
                markersize=4,
                elinewidth=1,
                label=mine.name if metric == metrics[0] else None,
            )
        axes.set_title(_title(metric, changes=AVERAGE in metrics))
        axes.set_yticks(range(len(families)), names)
        axes.set_ylim(len(families) - 0.5, -0.5)
        axes.grid(axis="x", color="#E0E0E0")
        axes.set_axisbelow(True)
        for between in range(1, len(families)):
            axes.axhline(between - 0.5, color="#E0E0E0", linewidth=0.8)
        if AVERAGE in metrics:
            axes.axvline(0, color=GREY, linewidth=0.8)
    for axes in list(grid.flat)[len(metrics) :]:
        axes.set_visible(False)
    row = max(0.3, 0.09 * len(seen))  # of a family, whose name takes two lines
    _legend(figure, width=10.5, height=2 * (0.6 + row * len(families)))


def _budgets(
    figure: "Figure", spent: Sequence[Spending], look: Mapping[str, Look]
) -> None:
    """A panel for each metric, minutes across, each twice as far as half of it."""
    grid = figure.subplots(2, 4)
    for axes, metric in zip(grid.flat, METRICS.values(), strict=False):
        for line in (line for line in spent if line.metric == metric.name):
            mine = look[line.labels[-1]]
            axes.errorbar(
                line.minutes,
                [value.mean or 0.0 for value in line.values],
                yerr=[value.sem or 0.0 for value in line.values],
                fmt=f"{mine.mark}-",
                color=mine.colour,
                markersize=4,
                elinewidth=1,
                label=_spender(line) if axes is grid.flat[0] else None,
            )
        ticks = sorted({m for line in spent for m in line.minutes})
        axes.set_xscale("log", base=2)
        axes.set_xticks(ticks, [f"{minutes:g}" for minutes in ticks])
        axes.set_xlabel("core-minutes a sample")
        axes.set_title(heading(metric))
    for axes in list(grid.flat)[len(METRICS) :]:
        axes.set_visible(False)
    _legend(figure, width=12.0, height=4.8)


def _spender(line: Spending) -> str:
    """Whose line it is, and of how many samples."""
    return f"{line.predictor}, {line.regime} (n = {span([v.n for v in line.values])})"


def _counted(points: Sequence[Point], family: str) -> str:
    """A family with how many samples its means are of."""
    return f"{family}\nn = {span([p.value.n for p in points if p.family == family])}"


def _title(metric: str, *, changes: bool) -> str:
    """Of a panel; of changes up is good, whatever the direction of the metric."""
    if metric not in METRICS:
        return metric
    return METRICS[metric].paper_name if changes else heading(METRICS[metric])
