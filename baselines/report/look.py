"""How a system looks in figures and on the page: a colour by name, a dash by regime."""

from dataclasses import dataclass
from typing import Final

from mpmworlds.baselines.report.board import Board
from mpmworlds.loaders.regimes import REGIMES

# First Okabe and Ito's palette, which colour-blind people tell apart, with a grey in
# place of its black, which a dark page swallows; then others that are still apart.
COLOURS: Final = (
    *("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#888888"),
    *("#8C6BD8", "#8C564B", "#999933", "#E0301E", "#17BECF", "#B0208F", "#4DAF4A"),
)
DASHES: Final[tuple[tuple[float, ...], ...]] = (
    *((), (4, 2), (1, 1.5), (6, 2, 1, 2), (6, 2, 1, 2, 1, 2)),
)
MARKS: Final = ("o", "s", "^", "D", "v")
WIDEST, THINNEST = 3.2, 1.2


@dataclass(frozen=True)
class Look:
    """Of one system."""

    name: str
    """What a legend calls it."""
    colour: str
    """As `#RRGGBB`."""
    dash: tuple[float, ...]
    """Lengths of strokes and gaps, in line widths; empty for a whole line."""
    mark: str
    """Marker of matplotlib."""
    width: float
    """Of a line [pt]: thinner than those below it, which show as a rim."""


def looks(board: Board) -> dict[str, Look]:
    """Look of each system by label; equal names have equal colours."""
    names = sorted({system.name for system in board.systems})
    regimes = list(REGIMES)
    widths = WIDEST - THINNEST
    found = {}
    for number, system in enumerate(board.systems):
        regime = system.provenance.regime
        place = regimes.index(regime) if regime in regimes else len(regimes)
        found[system.label] = Look(
            name=system.label + ("" if board.complete(system) else " (incomplete)"),
            colour=COLOURS[names.index(system.name) % len(COLOURS)],
            dash=DASHES[place % len(DASHES)],
            mark=MARKS[place % len(MARKS)],
            width=WIDEST - widths * number / len(board.systems),
        )
    return found
