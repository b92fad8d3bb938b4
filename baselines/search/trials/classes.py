"""Which class of material each thing is of."""

import copy
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from mpmworlds.baselines.search.trials.loss import Losses
from mpmworlds.baselines.search.trials.readings import (
    Trial,
    class_of,
    classes_of,
)
from mpmworlds.baselines.search.trials.tried import HOPELESS, Tried
from mpmworlds.baselines.search.trials.unusual import rare
from mpmworlds.sim.scene.objects import MATERIALS

Data = dict[str, Any]

LEAST_LIKELY: Final = 1.0  # loss of a class that nothing is known of
ENOUGH: Final = 5  # frames that tell a class where nothing else interferes
FINALISTS: Final = 3  # classes of matter that see the whole prefix
RIVALS: Final = 3  # classes that each thing is tried with by itself, and
COMMON: Final = 3  # common ones


class Classes:
    """Tries classes of things.

    Parameters
    ----------
    tried
        Where scenes are tried.
    """

    def __init__(self, tried: Tried) -> None:
        self._tried = tried
        self._rankings: dict[int, list[str]] = {}
        self._out: set[tuple[int, str, tuple[str, ...]]] = set()
        self._doubted: Counter[tuple[int, str]] = Counter()  # how often each was tried

    def rivals(self, number: int) -> list[str]:
        """The likeliest classes of a thing, the first one first, and common ones.

        What shows little before it touches others tells its class by the whole prefix
        only; three of four things are of a common one.
        """
        ranking = self._rankings[number]
        common = [name for name in self._tried.prior.common(COMMON) if name in ranking]
        return list(dict.fromkeys([*ranking[:RIVALS], *common]))

    def all_alike(self, data: Data) -> None:
        """Every thing of one class: what each of them shows tells its own class.

        Things that touch others before they show anything are judged once more, beside
        others that are of the classes they look best of.
        """
        tried, known = self._tried, self._tried.known
        sought = tried.sought(data)
        if not sought:
            tried.run(data, "as told")
            return
        contact = max(known.contacts.values(), default=0)
        early = min(max(contact + 8, 16), tried.lab.frames)
        until = {k: known.alone.get(k, early) for k in sought}
        touched = {k: known.contacts.get(k, 0) for k in sought}
        rest = [k for k in sought if until[k] - touched[k] < ENOUGH]
        ranking = self._rank(data, sought, early, until | dict.fromkeys(rest, early))
        mixed = copy.deepcopy(data)
        for number in sought:
            tried.turn(mixed, number, self._rankings[number][0])
        if 0 < len(rest) < len(sought):
            self._rank(mixed, rest, early, dict.fromkeys(rest, early))
            for number in rest:
                tried.turn(mixed, number, self._rankings[number][0])
        best = tried.of_class(data, sought, ranking[0])
        tried.run(best, f"all {ranking[0]}")
        if classes_of(mixed) != classes_of(best):
            tried.run(mixed, "each as it looks best")
        for name in ranking[1:FINALISTS]:
            tried.run(tried.of_class(data, sought, name), f"all {name}")

    def _rank(
        self, data: Data, turned: Sequence[int], early: int, until: Mapping[int, int]
    ) -> list[str]:
        """Rank classes of some things, which are all of one class at a time.

        Each is judged by its frames `until` one, of the first frames `early`. It
        returns classes by what they do for the whole scene, the best first.
        """
        tried, lab, prior = self._tried, self._tried.lab, self._tried.prior
        names = [
            name
            for name in prior.common(len(MATERIALS))
            if any(tried.may_be(data, number, name) for number in turned)
        ]
        scenes = {name: tried.of_class(data, turned, name) for name in names}
        losses: dict[str, Losses] = {}
        try:
            for name in names:
                losses[name] = lab.losses(scenes[name], early)
        finally:  # a budget that ends here has told something as well
            known = {n: losses[n].whole + tried.unusual(scenes[n]) for n in losses}
            ranking = sorted(known, key=lambda n: known[n])
            if len(losses) < len(names):
                tried.trials.extend(
                    Trial(known[n], scenes[n], f"all {n}", lab.seconds) for n in ranking
                )
        for number in turned:
            thing, end = data["objects"][number], until[number]
            color = thing["visualization"]["color"]
            lacks = {
                n: losses[n].until(color, end, LEAST_LIKELY) + rare(n, prior)
                for n in ranking
            }
            self._rankings[number] = sorted(
                (n for n in ranking if tried.may_be(data, number, n)),
                key=lacks.__getitem__,
            )
        return ranking

    def each_by_itself(self) -> None:
        """Each thing of another class than the others, one by one and in pairs."""
        tried, done = self._tried, set[tuple[str, ...]]()
        sought = tried.sought(tried.best.data)
        for _ in range(2):
            before = tried.best
            if classes_of(before.data) in done:
                return
            done.add(classes_of(before.data))
            for number in sought:
                for name in self.rivals(number):
                    best = tried.best.data
                    if name != class_of(best["objects"][number]):
                        changed = tried.of_class(best, [number], name)
                        tried.run(changed, f"{number} {name}")
            if tried.best is before:
                return

    def again(self) -> None:
        """Other classes with the numbers and walls of the best scene."""
        best, least = self._tried.best.data, self._tried.best.loss
        classes = classes_of(best)
        for number in self._tried.sought(best):
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
                self._tried.turn(changed, number, name, alike=name in MATERIALS)
                found = self._tried.run(changed, f"{number} {name}, again")
                if found.loss > HOPELESS * least:
                    self._out.add((number, name, classes))

    def _with_kinds(self, number: int) -> Iterator[str]:
        """Classes of a thing, the likeliest first, and kinds of the first of them."""
        likely, ranking = self.rivals(number), self._rankings[number]
        yield from likely
        for name in ranking[:RIVALS]:
            yield from self._tried.prior.kinds(name)
        yield from (name for name in ranking if name not in likely)
