"""The search itself: materials, gravity, walls, belts and numbers, by simulation."""

import copy
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.matter import of_matter
from mpmworlds.baselines.search.trials.classes import Classes
from mpmworlds.baselines.search.trials.exact import evened, exact
from mpmworlds.baselines.search.trials.lab import BudgetSpent
from mpmworlds.baselines.search.trials.numbers import Numbers
from mpmworlds.baselines.search.trials.readings import (
    Trial,
    distinct,
    reading_of,
)
from mpmworlds.baselines.search.trials.surroundings import OFTEN_BELTS, Surroundings
from mpmworlds.baselines.search.trials.tried import Tried
from mpmworlds.baselines.search.trials.unusual import passing

Data = dict[str, Any]

WORTHWHILE: Final = 0.02  # part of the loss that a round must save for another one
ROUNDS: Final = 6  # of refinement and doubt
AGAIN: Final = 1.3  # loss that a rival is worth less for each look at it
RUNNER_UP: Final = 1.6  # loss over the best one's of another reading worth refining
DRAWN_WELL: Final = 0.03  # loss of a scene after which no gravity is sought far away
DRAWN_ALIKE: Final = 0.015  # loss of a scene after which nothing is sought elsewhere
SCATTER: Final = 0.4  # first steps that numbers are moved by to begin again, about
FARTHEST: Final = 1.5  # the most of them
GROWTH: Final = 1.4  # of that distance after one that was worth a look
IDLE: Final = 8  # beginnings in a row that are known already: nothing else is possible
FINALISTS: Final = 5  # scenes of far gravities that see the whole prefix
READING: Final = "another reading of the prefix"
EVENED: Final = "a usual friction of the walls in the end"
USUAL: Final = 3  # classes of matter that scenes of far gravities are tried with
SWAPPED: Final = 0.2  # how often a class is another one then, and how often the walls


class Search:
    """Improves scenes, run by run.

    Parameters
    ----------
    tried
        Where scenes are tried.
    seed
        Which draws.
    """

    def __init__(self, tried: Tried, seed: int = 0) -> None:
        self._tried = tried
        self._classes = Classes(self._tried)
        self._surroundings = Surroundings(self._tried)
        self._numbers = Numbers(self._tried)
        self._random = np.random.Generator(np.random.Philox(seed))
        self._looks: Counter[Any] = Counter()  # at numbers of rivals, by reading

    @property
    def trials(self) -> list[Trial]:
        """All scenes that were run over the whole prefix."""
        return self._tried.trials

    @property
    def best(self) -> Trial:
        """The best of them."""
        return self._tried.best

    def run(self, scenes: Sequence[Data], far: Sequence[Data] = ()) -> None:
        """Search from scenes that differ in what was doubted, the likeliest first.

        Those of `far` are less likely: they are tried with better matter and walls.
        """
        try:
            self._classes.all_alike(scenes[0])
            self._readings(scenes[1:])
            self._surroundings.belts(OFTEN_BELTS)
            self._surroundings.walls()
            self._classes.each_by_itself()
            self._surroundings.belts()
            self._readings(scenes[1:] if far else [])
            self._round()
            if self.best.loss > DRAWN_WELL:
                self._far(far)
            self._refine()
            self._elsewhere()
        except BudgetSpent:
            pass
        if not self.trials:  # the budget is of no run
            self.trials.append(Trial(math.inf, scenes[0], "first guess"))

    @property
    def answers(self) -> list[Trial]:
        """All of them, with losses by which to choose what to answer with."""
        prior = self._tried.prior
        return [replace(t, loss=t.loss + passing(t.data, prior)) for t in self.trials]

    def candidates(self, count: int) -> list[Trial]:
        """The best scenes that differ in more than small numbers, best first."""
        return distinct(self.answers, reading_of)[:count]

    def _readings(self, scenes: Sequence[Data]) -> None:
        """Scenes of another gravity, law or nozzle, of the best matter and walls."""
        for scene in scenes:
            self._tried.run(self._of_best_matter(scene), READING)

    def _of_best_matter(self, scene: Data) -> Data:
        """A scene with the best matter and walls so far."""
        changed, best = copy.deepcopy(scene), self.best.data
        if self._tried.known.doubt.walls:
            changed["environment"]["walls"] = best["environment"]["walls"]
        for number in self._tried.sought(scene):
            matter = best["objects"][number]["physics_properties"]
            changed["objects"][number] = of_matter(
                scene["objects"][number], matter, self._tried.told(number)
            )
        return changed

    def _far(self, scenes: Sequence[Data]) -> None:
        """Scenes of far gravities, of the best matter and of classes that are common.

        The best matter so far was found under a gravity that may be far off. Half of
        the prefix tells which are worth the whole of it.
        """
        tried, rivals = self._tried, list[Data]()
        for scene in scenes:
            sought = tried.sought(scene)
            rivals.append(self._of_best_matter(scene))
            for name in tried.prior.common(USUAL) if sought else ():
                rivals.append(tried.of_class(scene, sought, name))
        half = tried.lab.frames // 2
        losses = [tried.lab.loss(data, half) + tried.unusual(data) for data in rivals]
        for place in np.argsort(losses, kind="stable")[:FINALISTS]:
            tried.run(rivals[place], READING)

    def _refine(self) -> None:
        """Numbers of the best scene, what was decided without them, and the rivals."""
        for _ in range(ROUNDS):
            before = self.best
            self._round()
            if self.best.loss > (1.0 - WORTHWHILE) * before.loss:
                break
        self._numbers.one_by_one(self.best)
        self._exactly()
        self._settle()
        for rival in distinct(self.trials, reading_of)[1:]:
            if rival.loss < RUNNER_UP * self.best.loss:
                self._numbers.together(rival)
                self._numbers.one_by_one(rival)

    def _round(self) -> None:
        """A look at the numbers of the best scene, and at what was decided before."""
        self._numbers.together(self.best)
        self._exactly()
        self._surroundings.other_walls()
        if self._numbers.looks == 1:
            self._surroundings.belts()
            self._surroundings.colliders()
            self._surroundings.spins()
        self._classes.again()
        self._runner_up()

    def _exactly(self) -> None:
        """Numbers that many scenes share, where the best scene is near to them."""
        tried, best = self._tried, self.best.data
        for what, changed in exact(best, tried.known.doubt, tried.prior):
            tried.run(changed, what)

    def _settle(self) -> None:
        """Walls with a usual friction, as all have, and the other numbers with that.

        What was found together with another friction makes up for it in the prefix.
        """
        self._surroundings.other_walls(all_laws=True)
        best = self.best.data
        even = evened(best, self._tried.prior)
        if self._tried.known.doubt.walls and even != best:
            self._numbers.but_walls(self._tried.run(even, EVENED))

    def _runner_up(self) -> None:
        """The best scene of other classes, of another law of walls or far gravity.

        It is judged with numbers of its own: what was looked at less often goes first,
        if it is about as good.
        """
        rivals = distinct(self.trials, reading_of)[1:]
        worth = [t.loss * AGAIN ** self._looks[reading_of(t.data)] for t in rivals]
        if worth and min(worth) < RUNNER_UP * self.best.loss:
            rival = rivals[int(np.argmin(worth))]
            self._looks[reading_of(rival.data)] += 1
            self._numbers.together(rival)

    def _elsewhere(self) -> None:
        """Begin again at some distance from the best scene, with what time is left.

        The distance grows while that leads to scenes that are worth a look, and shrinks
        where numbers are known so well that it leads astray.
        """
        lab, distance, idle = self._tried.lab, SCATTER, 0
        while lab.left > 0.0 and self.best.loss > DRAWN_ALIKE and idle < IDLE:
            before, runs = self.best, lab.runs
            start = self._swapped(before.data)
            data = self._numbers.scattered(start, distance, self._random)
            trial = self._tried.run(data, "elsewhere")
            worth = trial.loss < RUNNER_UP * before.loss
            if worth:
                self._numbers.together(trial)
            if start == before.data:
                factor = GROWTH if worth else 1.0 / GROWTH
                distance = min(distance * factor, FARTHEST)
            if self.best is not before:
                self._refine()
            # What is known already takes no time: nothing may be left to be changed.
            idle = idle + 1 if lab.runs == runs else 0

    def _swapped(self, data: Data) -> Data:
        """A scene with another class of a thing or other walls; mostly the same."""
        sought, what = self._tried.sought(data), self._random.random()
        if sought and what < SWAPPED:
            changed, number = copy.deepcopy(data), int(self._random.choice(sought))
            name = str(self._random.choice(self._classes.rivals(number)))
            self._tried.turn(changed, number, name, alike=True)
            return changed
        if what > 1.0 - SWAPPED:
            return self._surroundings.drawn(data, self._random)
        return data
