"""The search itself: materials, gravity, walls, belts and numbers, by simulation."""

import copy
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.matter import of_matter
from mpmworlds.baselines.search.prior import Prior
from mpmworlds.baselines.search.trials.lab import BudgetSpent, Lab
from mpmworlds.baselines.search.trials.least_squares import Point, fit_together
from mpmworlds.baselines.search.trials.loss import Losses
from mpmworlds.baselines.search.trials.moves import Doubt, Move, moves_of
from mpmworlds.baselines.search.trials.readings import (
    Trial,
    class_of,
    classes_of,
    distinct,
    may_be,
    pull_of,
    reading_of,
    shared,
)
from mpmworlds.baselines.search.trials.refine import Line, refine
from mpmworlds.baselines.search.trials.unusual import customary, rare, unusual
from mpmworlds.sim.scene.objects import MATERIALS

Data = dict[str, Any]

LEAST_LIKELY: Final = 1.0  # loss of a class that nothing is known of
ENOUGH: Final = 5  # frames that tell a class where nothing else interferes
FINALISTS: Final = 3  # classes of matter that see the whole prefix
RIVALS: Final = 3  # classes that each thing is tried with by itself
CONTACTS: Final = ("separate", "sticky", "slip")  # of colliders, the usual one first
BELT_GAIN: Final = 0.004  # loss that a belt must save
BELT_SPEEDS: Final = (0.93, -0.93)  # the median of the train split [m/s]
BELTS: Final = ("box", "capsule", "rounded_box")
NEAR: Final = 0.08  # loss below which what shows least is sought, too
MISSED: Final = 0.1  # loss from which on a usual gravity may be refined
LATE: Final = 2  # looks at all numbers before that
FEW: Final = 2  # things of matter of which it is sought in any case
FINE: Final = 0.08  # part of a first step below which none is worth a run
LOOKS: Final = 1  # at all numbers of a scene, before what was decided is doubted
WORTHWHILE: Final = 0.02  # part of the loss that a round must save for another one
ROUNDS: Final = 6  # of refinement and doubt
HOPELESS: Final = 2.0  # loss over the best one's of a class that is not doubted again
DRAWN_ALIKE: Final = 0.015  # loss of a scene after which nothing is sought elsewhere
SCATTER: Final = 0.4  # first steps that numbers are moved by to begin again, about
FARTHEST: Final = 1.5  # the most of them
GROWTH: Final = 1.4  # of that distance after one that was worth a look
SWAPPED: Final = 0.2  # how often a class is another one then, and how often the walls
RUNNER_UP: Final = 1.6  # loss over the best one's of another reading worth refining


@dataclass(frozen=True)
class Known:
    """What is not to be sought, and what may be doubted."""

    doubt: Doubt
    """Numbers that may be wrong."""
    gravity: tuple[float, float] | None
    """Gravity, where flights tell it [m/s^2]."""
    contacts: Mapping[int, int]
    """First frames by which things of matter have touched something, by their numbers.
    """
    touched: Sequence[int]
    """Numbers of colliders that matter comes near to."""
    alone: Mapping[int, int]
    """Frames until things of matter touch each other, by their numbers; none of those
    that do not."""


class Search:
    """Improves scenes, run by run.

    Parameters
    ----------
    lab
        Where scenes are run.
    prior
        What is usual.
    known
        What is not to be sought.
    seed
        Which draws.
    """

    def __init__(self, lab: Lab, prior: Prior, known: Known, seed: int = 0) -> None:
        self._lab, self._prior, self._known = lab, prior, known
        self._random = np.random.Generator(np.random.Philox(seed))
        self._rankings: dict[int, list[str]] = {}
        self._lines: dict[str, Line] = {}
        self._looks = 0  # at all numbers of a scene
        self._out: set[tuple[int, str, tuple[str, ...]]] = set()
        self._looked_at: set[tuple[Any, ...]] = set()  # classes, gravities of rivals
        self._walls_out: set[tuple[str, tuple[str, ...]]] = set()
        self._doubted: Counter[tuple[int, str]] = Counter()  # how often each was tried
        self.trials: list[Trial] = []
        """All scenes that were run over the whole prefix."""

    @property
    def best(self) -> Trial:
        """The best of them."""
        return min(self.trials, key=lambda trial: trial.loss)

    def run(self, scenes: Sequence[Data], far: Sequence[Data] = ()) -> None:
        """Search from scenes that differ in what was doubted, the likeliest first.

        Those of `far` are less likely: they are tried with better matter and walls.
        """
        try:
            self._all_alike(scenes[0])
            self._rivals_of_scene(scenes[1:])
            self._walls()
            self._each_by_itself()
            self._belts()
            self._rivals_of_scene([*scenes[1:], *far] if far else [])
            self._refine_all()
            self._elsewhere()
        except BudgetSpent:
            pass
        if not self.trials:  # the budget is of no run
            self.trials.append(Trial(math.inf, scenes[0], "first guess"))

    def _try(self, data: Data, what: str) -> Trial:
        loss = self._lab.loss(data) + self._unusual(data)
        self.trials.append(Trial(loss, data, what, self._lab.seconds))
        return self.trials[-1]

    def _unusual(self, data: Data) -> float:
        return unusual(data, self._prior, self._known.gravity)

    def _told(self, number: int) -> Mapping[str, Any]:
        return self._known.doubt.told.get(number, {})

    def _sought(self, data: Data) -> list[int]:
        """Numbers of things whose class is not told."""
        return [
            number
            for number, thing in enumerate(data["objects"])
            if "physics_properties" in thing
            and not self._told(number).get("physics_properties")
        ]

    def _all_alike(self, data: Data) -> None:
        """Every thing of one class: what each of them shows tells its own class.

        Things that touch others before they show anything are judged once more, beside
        others that are of the classes they look best of.
        """
        sought = self._sought(data)
        if not sought:
            self._try(data, "as told")
            return
        contact = max(self._known.contacts.values(), default=0)
        early = min(max(contact + 8, 16), self._lab.frames)
        until = {k: self._known.alone.get(k, early) for k in sought}
        touched = {k: self._known.contacts.get(k, 0) for k in sought}
        rest = [k for k in sought if until[k] - touched[k] < ENOUGH]
        ranking = self._rank(data, sought, early, until | dict.fromkeys(rest, early))
        mixed = copy.deepcopy(data)
        for number in sought:
            self._turn(mixed, number, self._rankings[number][0])
        if 0 < len(rest) < len(sought):
            self._rank(mixed, rest, early, dict.fromkeys(rest, early))
            for number in rest:
                self._turn(mixed, number, self._rankings[number][0])
        best = self._of_class(data, sought, ranking[0])
        self._try(best, f"all {ranking[0]}")
        if classes_of(mixed) != classes_of(best):
            self._try(mixed, "each as it looks best")
        for name in ranking[1:FINALISTS]:
            self._try(self._of_class(data, sought, name), f"all {name}")

    def _rank(
        self, data: Data, turned: Sequence[int], early: int, until: Mapping[int, int]
    ) -> list[str]:
        """Rank classes of some things, which are all of one class at a time.

        Each is judged by its frames `until` one, of the first frames `early`. It
        returns classes by what they do for the whole scene, the best first.
        """
        names = sorted(MATERIALS, key=lambda n: (-self._prior.materials[n]["share"], n))
        scenes = {name: self._of_class(data, turned, name) for name in names}
        losses: dict[str, Losses] = {}
        try:
            for name in names:
                losses[name] = self._lab.losses(scenes[name], early)
        finally:  # a budget that ends here has told something as well
            known = {n: losses[n].whole + self._unusual(scenes[n]) for n in losses}
            ranking = sorted(known, key=lambda n: known[n])
            if len(losses) < len(names):
                self.trials.extend(
                    Trial(known[n], scenes[n], f"all {n}", self._lab.seconds)
                    for n in ranking
                )
        for number in turned:
            thing, end = data["objects"][number], until[number]
            color = thing["visualization"]["color"]
            lacks = {
                n: losses[n].until(color, end, LEAST_LIKELY) + rare(n, self._prior)
                for n in ranking
            }
            self._rankings[number] = sorted(
                (n for n in ranking if may_be(thing, n)),
                key=lacks.__getitem__,
            )
        return ranking

    def _of_class(self, data: Data, numbers: Sequence[int], name: str) -> Data:
        changed = copy.deepcopy(data)
        for number in numbers:
            thing = changed["objects"][number]
            self._turn(changed, number, name if may_be(thing, name) else "elastic")
        return changed

    def _turn(self, data: Data, number: int, name: str, *, alike: bool = False) -> None:
        """Make a thing of a typical material of a class, or of one like its own."""
        matter, thing = self._prior.typical(name), data["objects"][number]
        if alike:
            own = thing["physics_properties"]
            usual = self._prior.typical(class_of(thing))
            matter |= {key: own[key] for key in shared(usual, matter)}
        data["objects"][number] = of_matter(thing, matter, self._told(number))

    def _rivals_of_scene(self, scenes: Sequence[Data]) -> None:
        """Scenes of another gravity, law or nozzle, of the best matter and walls."""
        for scene in scenes:
            changed = copy.deepcopy(scene)
            if self._known.doubt.walls:
                changed["environment"]["walls"] = self.best.data["environment"]["walls"]
            for number in self._sought(scene):
                matter = self.best.data["objects"][number]["physics_properties"]
                changed["objects"][number] = of_matter(
                    scene["objects"][number], matter, self._told(number)
                )
            self._try(changed, "another reading of the prefix")

    def _walls(self) -> None:
        """Each law of the walls, rough and smooth, with the best matter so far."""
        if not self._known.doubt.walls:
            return
        start = self.best.data
        for walls in self._prior.walls:
            usual = walls["frictions"]
            for friction in dict.fromkeys((usual[0], usual[len(usual) // 2])):
                self._try_walls(start, walls["contact"], friction)
        self._everywhere()

    def _other_walls(self) -> None:
        """Other laws of the walls, and a little more and less friction, while it helps.

        Frictions are those that are usual: most scenes have one of a handful.
        """
        while self._known.doubt.walls:
            before = self.best
            now = before.data["environment"]["walls"]
            for walls in self._prior.walls:
                usual, law = walls["frictions"], walls["contact"]
                key = law, classes_of(before.data)
                if key in self._walls_out and law != now["contact"]:
                    continue
                place = min(
                    range(len(usual)), key=lambda k: abs(usual[k] - now["friction"])
                )
                reach = 1 if law == now["contact"] else 0
                for friction in usual[max(place - reach, 0) : place + reach + 1]:
                    loss = self._try_walls(before.data, law, friction)
                    if loss > HOPELESS * self.best.loss:
                        self._walls_out.add(key)
            self._everywhere()
            if self.best is before:
                return

    def _try_walls(self, data: Data, law: str, friction: float) -> float:
        walls = {"contact": law, "friction": friction}
        if walls.items() <= data["environment"]["walls"].items():
            return 0.0
        changed = copy.deepcopy(data)
        changed["environment"]["walls"] |= walls
        return self._try(changed, f"walls {law} {friction}").loss

    def _everywhere(self) -> None:
        """Colliders of the law of the walls: they often are."""
        changed = copy.deepcopy(self.best.data)
        law = changed["environment"]["walls"]["contact"]
        for number, thing in enumerate(changed["objects"]):
            if "contact" in thing and "contact" not in self._told(number):
                thing["contact"]["type"] = law
        if changed != self.best.data and self._known.touched:
            self._try(changed, f"{law} everywhere")

    def _contacts(self) -> None:
        """Other laws of colliders, once."""
        if self._looks != 1:
            return
        for number in self._known.touched:
            if "contact" in self._told(number):
                continue
            before = self.best.data
            for law in CONTACTS:
                changed = copy.deepcopy(before)
                contact = changed["objects"][number]["contact"]
                if contact["type"] != law:
                    contact["type"] = law
                    self._try(changed, f"{number} {law}")

    def _each_by_itself(self) -> None:
        """Each thing of another class than the others, one by one and in pairs."""
        sought = self._sought(self.best.data)
        tried: set[tuple[str, ...]] = set()
        for _ in range(2):
            before = self.best
            if classes_of(before.data) in tried:
                return
            tried.add(classes_of(before.data))
            for number in sought:
                for name in self._rankings[number][:RIVALS]:
                    thing = self.best.data["objects"][number]
                    if name == class_of(thing):
                        continue
                    changed = self._of_class(self.best.data, [number], name)
                    self._try(changed, f"{number} {name}")
            if self.best is before:
                return

    def _belts(self) -> None:
        """Still things that matter comes near to may be belts."""
        for number in self._known.touched:
            thing = self.best.data["objects"][number]
            told = self._told(number)
            still = thing["object_type"] == "static_collider"
            if (
                not still
                or thing["shape"]["type"] not in BELTS
                or told.get("object_type")
            ):
                continue
            before = self.best
            for speed in BELT_SPEEDS:
                changed = copy.deepcopy(before.data)
                belt = changed["objects"][number]
                belt["object_type"] = "kinematic_collider"
                belt["kinematics"] = {"type": "conveyor", "surface_speed": speed}
                belt["contact"] = {"type": "slip", "friction": 0.8, "skin_cells": 0.3}
                loss = self._lab.loss(changed) + self._unusual(changed)
                if loss < before.loss - BELT_GAIN:
                    self.trials.append(
                        Trial(loss, changed, f"{number} is a belt", self._lab.seconds)
                    )

    def _refine_all(self) -> None:
        """Numbers of the best scene, what was decided without them, and the rivals."""
        for _ in range(ROUNDS):
            before = self.best
            self._fit_together(before)
            self._other_walls()
            self._contacts()
            self._classes_again()
            self._runner_up()
            if self.best.loss > (1.0 - WORTHWHILE) * before.loss:
                break
        self._refine(self.best)
        for rival in distinct(self.trials, reading_of)[1:]:
            if rival.loss < RUNNER_UP * self.best.loss:
                self._fit_together(rival)
                self._refine(rival)

    def _elsewhere(self) -> None:
        """Begin again at some distance from the best scene, with what time is left.

        The distance grows while that leads to scenes that are worth a look, and shrinks
        where numbers are known so well that it leads astray.
        """
        scatter = SCATTER
        while self._lab.left > 0.0 and self.best.loss > DRAWN_ALIKE:
            before = self.best
            swapped = self._swapped(before.data)
            data = self._scattered(swapped or before.data, scatter)
            trial = self._try(data, "elsewhere")
            worth = trial.loss < RUNNER_UP * before.loss
            if worth:
                self._fit_together(trial)
            if not swapped:
                scatter = min(scatter * (GROWTH if worth else 1.0 / GROWTH), FARTHEST)
            if self.best is not before:
                self._refine_all()

    def _swapped(self, data: Data) -> Data | None:
        """A scene with another class of a thing or other walls; mostly none."""
        draw, changed = self._random, copy.deepcopy(data)
        sought = self._sought(data)
        what = draw.random()
        if sought and what < SWAPPED:
            number = int(draw.choice(sought))
            rivals = self._rankings[number][:RIVALS]
            self._turn(changed, number, str(draw.choice(rivals)), alike=True)
        elif self._known.doubt.walls and what > 1.0 - SWAPPED:
            shares = np.array([w["share"] for w in self._prior.walls])
            law = self._prior.walls[draw.choice(len(shares), p=shares / shares.sum())]
            changed["environment"]["walls"] |= {
                "contact": law["contact"],
                "friction": float(draw.choice(law["frictions"])),
            }
        return None if changed == data else changed

    def _scattered(self, data: Data, scatter: float) -> Data:
        """A scene whose numbers are moved by some first steps, about."""
        by_color = self._lab.losses(self.best.data).by_color
        for move in self._moves(data, by_color, fine=True):
            by = scatter * move.step * self._random.standard_normal()
            data = move.of(data, by)
        return data

    def _classes_again(self) -> None:
        """Other classes with the numbers and walls of the best scene."""
        best, least = self.best.data, self.best.loss
        classes = classes_of(best)
        for number in self._sought(best):
            own = class_of(best["objects"][number])
            rivals = [
                name
                for name in self._with_kinds(number)
                if name != own and (number, name, classes) not in self._out
            ]
            # None is left out for good: those that were tried less often go first.
            rivals.sort(key=lambda name: self._doubted[number, name])
            for name in rivals[:RIVALS]:
                self._doubted[number, name] += 1
                changed = copy.deepcopy(best)
                self._turn(changed, number, name, alike=name in MATERIALS)
                found = self._try(changed, f"{number} {name}, again")
                if found.loss > HOPELESS * least:
                    self._out.add((number, name, classes))

    def _with_kinds(self, number: int) -> Iterator[str]:
        """Classes of a thing, the likeliest first, and kinds of the first of them."""
        for place, name in enumerate(self._rankings[number]):
            yield name
            if place < RIVALS:
                yield from self._prior.kinds(name)

    def _runner_up(self) -> None:
        """The best scene of other classes, or of a gravity far from that of the best.

        Each is judged with numbers of its own, once.
        """
        doubted = (classes_of,) if self._known.gravity else (classes_of, pull_of)
        for by in doubted:
            for rival in distinct(self.trials, by)[1:]:
                key = by(rival.data)
                if rival.loss > RUNNER_UP * self.best.loss:
                    break
                if key not in self._looked_at:
                    self._looked_at.add(key)
                    self._fit_together(rival)
                    break

    def _fit_together(self, trial: Trial) -> None:
        """All numbers of one scene together."""
        seen = self._lab.losses(trial.data)
        few = len(classes_of(trial.data)) <= FEW
        fit_together(
            Point(trial.data, trial.loss, seen.residual),
            self._moves(
                trial.data,
                seen.by_color,
                fine=trial.loss < NEAR or (self._looks > 0 and few),
            ),
            self._point,
            lambda: self._lab.left > 0.0,
            LOOKS,
        )
        self._looks += 1

    def _refine(self, trial: Trial) -> None:
        """Numbers of one scene, one after the other."""
        by_color = self._lab.losses(trial.data).by_color
        refine(
            trial.data,
            trial.loss,
            self._moves(trial.data, by_color),
            lambda data, what: self._try(data, what).loss,
            FINE,
            lambda: self._lab.left > 0.0,
            self._lines,
        )

    def _moves(
        self, data: Data, by_color: Mapping[str, float], *, fine: bool = False
    ) -> list[Move]:
        """What may be changed; a usual gravity only if nothing else has helped."""
        doubt = self._known.doubt
        settled = self.best.loss < MISSED or self._looks < LATE
        if settled and customary(data, self._prior):
            doubt = replace(doubt, gravity=())
        return list(moves_of(data, doubt, by_color, fine=fine))

    def _point(self, data: Data, what: str) -> Point:
        trial = self._try(data, what)
        return Point(data, trial.loss, self._lab.losses(data).residual)

    def candidates(self, count: int) -> list[Trial]:
        """The best scenes that differ in more than small numbers, best first."""
        return distinct(self.trials, reading_of)[:count]
