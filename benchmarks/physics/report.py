"""The table and the plots of a benchmark."""

from pathlib import Path

import matplotlib as mpl
from benchmarks.physics.case import Case, Plot, Result
from matplotlib.figure import Figure

HEAD = (
    "| case | cells | quantity | observed | reference | error | tolerance "
    "| source | |\n|---|---|---|---|---|---|---|---|---|\n"
)


def table(results: dict[Case, Result], *, coarse: bool) -> str:
    """Markdown of all checks, a row each.

    An error is a part of the reference, or what lies beyond a bound.
    """
    rows = []
    for case, result in results.items():
        cells = case.coarse if coarse else case.fine
        for check in result.checks:
            numbers = (
                f"{check.observed:.4g} | {check.reference} | "
                f"{check.error:.2g} | {check.tolerance:g}"
            )
            name = case.name.replace("_", " ")
            verdict = "ok" if check.ok else "**failed**"
            rows.append(
                f"| {name} | {cells} | {check.quantity} | {numbers} | "
                f"{check.source} | {verdict} |\n"
            )
    return HEAD + "".join(rows)


def draw(plots: list[Plot], path: Path) -> None:
    """Write plots side by side as one picture (.png)."""
    mpl.rcParams.update({"axes.grid": True, "grid.alpha": 0.3, "font.size": 9})
    figure = Figure(figsize=(5.0 * len(plots), 3.6), dpi=120, layout="constrained")
    panels = figure.subplots(1, len(plots), squeeze=False)[0]
    for axes, plot in zip(panels, plots, strict=True):
        for curve in plot.curves:
            style = "ko" if curve.reference else "-"
            size = 4 if curve.reference else 0
            axes.plot(curve.x, curve.y, style, label=curve.label, markersize=size)
        axes.set(title=plot.title, xlabel=plot.x_label, ylabel=plot.y_label)
        axes.legend()
    figure.savefig(path, metadata={"Software": None})
