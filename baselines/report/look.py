"""How a system looks in figures and on the page: a colour by name, a dash by regime."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from mpmworlds.baselines.system import System
from mpmworlds.loaders.regimes import REGIMES

# Of Okabe and Ito's palette, which colour-blind people tell apart; the last one in
# place of their black, which a dark page swallows.
COLOURS: Final = (
    *("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#888888"),
)
DASHES: Final[tuple[tuple[float, ...], ...]] = (
    *((), (4, 2), (1, 1.5), (6, 2, 1, 2), (6, 2, 1, 2, 1, 2)),
)
MARKS: Final = ("o", "s", "^", "D", "v")


@dataclass(frozen=True)
class Look:
    """Of one system."""

    colour: str
    """As `#RRGGBB`."""
    dash: tuple[float, ...]
    """Lengths of strokes and gaps, in line widths; empty for a whole line."""
    mark: str
    """Marker of matplotlib."""


def looks(systems: Sequence[System]) -> dict[str, Look]:
    """Look of each system by label; equal names have equal colours."""
    names = sorted({system.name for system in systems})
    regimes = list(REGIMES)
    found = {}
    for system in systems:
        regime = system.provenance.regime
        place = regimes.index(regime) if regime in regimes else len(regimes)
        found[system.label] = Look(
            colour=COLOURS[names.index(system.name) % len(COLOURS)],
            dash=DASHES[place % len(DASHES)],
            mark=MARKS[place % len(MARKS)],
        )
    return found
