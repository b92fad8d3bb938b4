"""Numbers of a scene: all of them together, one after the other, at random."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.trials.least_squares import Point, fit_together
from mpmworlds.baselines.search.trials.moves import Doubt, Move, moves_of
from mpmworlds.baselines.search.trials.readings import Trial
from mpmworlds.baselines.search.trials.refine import Line, refine
from mpmworlds.baselines.search.trials.tried import Tried
from mpmworlds.baselines.search.trials.unusual import customary

Data = dict[str, Any]

NEAR: Final = 0.08  # loss below which what shows least is sought, too
MISSED: Final = 0.1  # loss from which on a usual gravity may be refined
LATE: Final = 2  # looks at all numbers before that
FINE: Final = 0.08  # part of a first step below which none is worth a run
LOOKS: Final = 1  # at all numbers of a scene, before what was decided is doubted
SETTLING: Final = 4  # and where nothing is to be decided any more


class Numbers:
    """Changes numbers of scenes.

    Parameters
    ----------
    tried
        Where scenes are tried.
    """

    def __init__(self, tried: Tried) -> None:
        self._tried = tried
        self._lines: dict[str, Line] = {}
        self.looks = 0
        """How often all numbers of a scene were looked at."""

    def together(self, trial: Trial) -> None:
        """All numbers of one scene together."""
        self._fit(trial, self._tried.known.doubt, LOOKS)

    def but_walls(self, trial: Trial) -> None:
        """All numbers of one scene but those of its walls, until that helps no more."""
        self._fit(trial, replace(self._tried.known.doubt, walls=False), SETTLING)

    def _fit(self, trial: Trial, doubt: Doubt, looks: int) -> None:
        seen = self._tried.lab.losses(trial.data)
        fit_together(
            Point(trial.data, trial.loss, seen.residual),
            self._moves(trial.data, doubt, seen.by_color, fine=trial.loss < NEAR),
            self._point,
            self._going,
            looks,
        )
        self.looks += 1

    def one_by_one(self, trial: Trial) -> None:
        """Numbers of one scene, one after the other."""
        by_color = self._tried.lab.losses(trial.data).by_color
        refine(
            trial.data,
            trial.loss,
            self._moves(trial.data, self._tried.known.doubt, by_color),
            lambda data, what: self._tried.run(data, what).loss,
            FINE,
            self._going,
            self._lines,
        )

    def scattered(self, data: Data, distance: float, draw: np.random.Generator) -> Data:
        """A scene whose numbers are moved by so many first steps, about."""
        for move in self._moves(data, self._tried.known.doubt, {}, fine=True):
            data = move.of(data, distance * move.step * draw.standard_normal())
        return data

    def _moves(
        self,
        data: Data,
        doubt: Doubt,
        by_color: Mapping[str, float],
        *,
        fine: bool = False,
    ) -> list[Move]:
        """What may be changed; a usual gravity only if nothing else has helped."""
        settled = self._tried.best.loss < MISSED or self.looks < LATE
        if settled and customary(data, self._tried.prior):
            doubt = replace(doubt, gravity=())
        return list(moves_of(data, doubt, by_color, fine=fine))

    def _point(self, data: Data, what: str) -> Point:
        loss = self._tried.run(data, what).loss
        return Point(data, loss, self._tried.lab.losses(data).residual)

    def _going(self) -> bool:
        return self._tried.lab.left > 0.0
