"""The statistics of a corpus as a figure of three panels, as in the paper.

matplotlib is an extra; everything else works without it.
"""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mpmworlds.builder.statistics.counts import Statistics
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.targets import check_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE: Final = (
    "#0072B2"  # of Okabe and Ito's palette, which colour-blind people tell apart
)
GREY: Final = "#404040"
SIZE: Final = (10.0, 3.4)  # of the figure [inch]
FORMATS: Final[dict[str, dict[str, Any]]] = {  # what keeps a date out of each
    ".pdf": {"CreationDate": None, "ModDate": None},
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": "mpmworlds"},
}
STYLE: Final[Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib, so it is the same anywhere
    "font.size": 9.0,
    "axes.edgecolor": GREY,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "pdf.fonttype": 42,
    "svg.hashsalt": "mpmworlds",
}


def write_figure(found: Statistics, path: Path) -> None:
    """Draw materials, objects per scene and object types: the same bytes every time.

    Parameters
    ----------
    found
        Statistics of a corpus.
    path
        File to write, ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    ValueError
        If the file is to be of another format.
    RuntimeError
        If matplotlib is not installed.
    """
    check_file(path)
    if path.suffix not in FORMATS:
        raise ValueError(
            f"{path}: a figure of format {path.suffix!r}, must be one of "
            f"{', '.join(FORMATS)}"
        )
    try:
        import matplotlib as mpl
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        raise RuntimeError(
            "a figure needs matplotlib: pip install 'mpmworlds[plots]'"
        ) from None
    buffer = io.BytesIO()
    with mpl.rc_context():  # whatever style the caller has chosen
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        figure = Figure(figsize=SIZE, dpi=200, layout="constrained")
        left, middle, right = figure.subplots(1, 3, width_ratios=(1.1, 1.0, 0.9))
        _bars(left, "Materials", found.materials, found.scenes)
        _histogram(middle, found)
        _bars(right, "Object types", found.object_types, found.scenes)
        form = path.suffix.removeprefix(".")
        figure.savefig(buffer, format=form, metadata=FORMATS[path.suffix])
    write_atomically(path, buffer.getvalue())


def _bars(axes: "Axes", title: str, counts: Mapping[str, int], scenes: int) -> None:
    """Scenes with each of some things, the most frequent on top."""
    names = [name.replace("_", " ") for name in counts]
    bars = axes.barh(names, list(counts.values()), height=0.72, color=BLUE)
    shares = [_percent(count / scenes) for count in counts.values()]
    axes.bar_label(bars, shares, padding=3, color=GREY, fontsize=8)
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.margins(x=0.2)  # room for the labels
    axes.set(title=title, xlabel="scenes with it")
    axes.xaxis.set_major_locator(_few_ticks())
    axes.xaxis.set_major_formatter("{x:,.0f}")


def _histogram(axes: "Axes", found: Statistics) -> None:
    """Scenes per number of objects."""
    sizes = range(min(found.num_objects), max(found.num_objects) + 1)
    counts = [found.num_objects.get(n, 0) for n in sizes]
    bars = axes.bar(list(sizes), counts, width=0.8, color=BLUE)
    shares = [count / found.scenes for count in counts]
    labels = [f"{share:.0%}" if share >= 0.01 else "" for share in shares]
    axes.bar_label(bars, labels, padding=2, color=GREY, fontsize=8)
    axes.set_xticks(list(sizes))
    axes.margins(y=0.12)
    axes.set(title="Objects per scene", xlabel="objects", ylabel="scenes")
    axes.yaxis.set_major_locator(_few_ticks())
    axes.yaxis.set_major_formatter("{x:,.0f}")
    text = f"median {found.median_objects:g}\nmean {found.mean_objects:.1f}"
    axes.annotate(text, (0.98, 0.97), xycoords="axes fraction", ha="right", va="top")


def _few_ticks() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(4, integer=True)


def _percent(share: float) -> str:
    """A share short enough for a bar."""
    return f"{share:.0%}" if share >= 0.1 or not share else f"{share:.1%}"
