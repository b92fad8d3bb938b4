"""The ranking of the systems of a split, by their anchored scores."""

from dataclasses import dataclass
from typing import Final

from mpmworlds.baselines.report.board import Board
from mpmworlds.baselines.report.numbers import merged_rows
from mpmworlds.baselines.system import System
from mpmworlds.metrics import SCORED, Interval, anchored_score

FLOOR: Final = "copy_last"
"""Predictor that scores 0."""


@dataclass(frozen=True, eq=False)
class Place:
    """One line of a ranking."""

    rank: int | None
    """From 1 on; None for what knows the answers, which takes nobody's place."""
    system: System
    """Which system."""
    score: Interval
    """Its anchored score: 0 is copy_last, 1 the noise ceiling."""


@dataclass(frozen=True, eq=False)
class Ranking:
    """The systems of a split, the best first, or why there is no order."""

    places: tuple[Place, ...]
    """Sorted by score, then by label."""
    missing: str
    """Why there is none; empty if there is one."""


def rank(board: Board) -> Ranking:
    """Rank the systems of a board."""
    floors = [s for s in board.systems if s.provenance.predictor == FLOOR]
    missing = _missing(board, floors)
    if missing:
        return Ranking((), missing)
    # It takes no notice of what it is told: one regime of it serves all.
    floor = merged_rows(floors[0])
    scored = [
        (system, anchored_score(merged_rows(system), floor, board.ceilings))
        for system in board.systems
    ]
    scored.sort(key=lambda pair: (-(pair[1].mean or 0.0), pair[0].label))
    places, number = [], 0
    for system, score in scored:
        answers = system.provenance.knows_answers
        number += not answers
        places.append(Place(None if answers else number, system, score))
    return Ranking(tuple(places), "")


def _missing(board: Board, floors: list[System]) -> str:
    if not floors:
        return (
            f"{board.name}: no ranking, since it needs results of {FLOOR} on the same "
            "samples; evaluate it and name its folder, too"
        )
    anchored = {name for name, metric in SCORED.items() if metric.anchored}
    without = [
        s for s in board.samples if not anchored <= board.ceilings.get(s, {}).keys()
    ]
    if without:
        return (
            f"{board.name}: no ranking, since {len(without)} of {len(board.samples)} "
            f"samples have no noise ceiling (the first is {without[0]}); evaluate a "
            "release whose evaluation samples were measured"
        )
    return ""
