"""Scenes that are tried against one prefix: what is kept of them, what is told."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from mpmworlds.baselines.search.matter import looks_like, of_matter
from mpmworlds.baselines.search.perception.edges import Edge
from mpmworlds.baselines.search.prior import Prior
from mpmworlds.baselines.search.trials.lab import Lab
from mpmworlds.baselines.search.trials.moves import Doubt
from mpmworlds.baselines.search.trials.readings import (
    Trial,
    class_of,
    may_be,
    shared,
)
from mpmworlds.baselines.search.trials.unusual import unusual

Data = dict[str, Any]

# Loss over the best one's of a class or of walls that are not doubted again.
HOPELESS: Final = 2.0
INSTEAD: Final = ("elastic", "elastic_fem")  # any body may be of one of them


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
    edges: Mapping[int, Edge] = field(default_factory=dict)
    """How the edges of bodies look, by their numbers."""


class Tried:
    """All that was tried of a prefix.

    Parameters
    ----------
    lab
        Where scenes are run.
    prior
        What is usual.
    known
        What is not to be sought.
    """

    def __init__(self, lab: Lab, prior: Prior, known: Known) -> None:
        self.lab, self.prior, self.known = lab, prior, known
        self.trials: list[Trial] = []
        """All scenes that were run over the whole prefix."""

    @property
    def best(self) -> Trial:
        """The best of them."""
        return min(self.trials, key=lambda trial: trial.loss)

    def run(self, data: Data, what: str) -> Trial:
        """Run a scene; `what` says for people how it came about."""
        self.trials.append(self.looked(data, what))
        return self.trials[-1]

    def looked(self, data: Data, what: str) -> Trial:
        """Run a scene that is not to be kept as it is."""
        loss = self.lab.loss(data) + self.unusual(data)
        return Trial(loss, data, what, self.lab.seconds)

    def unusual(self, data: Data) -> float:
        """Loss that makes up for how unusual a scene is."""
        return unusual(data, self.prior, self.known.gravity)

    def told(self, number: int) -> Mapping[str, Any]:
        """What is told of a thing."""
        return self.known.doubt.told.get(number, {})

    def sought(self, data: Data) -> list[int]:
        """Numbers of things whose class is not told."""
        return [
            number
            for number, thing in enumerate(data["objects"])
            if "physics_properties" in thing
            and not self.told(number).get("physics_properties")
        ]

    def may_be(self, data: Data, number: int, name: str) -> bool:
        """Whether a thing may be of a class, by what it is and how its edge looks."""
        edge = self.known.edges.get(number, Edge.UNCLEAR)
        return may_be(data["objects"][number], name) and looks_like(name, edge)

    def turn(self, data: Data, number: int, name: str, *, alike: bool = False) -> None:
        """Make a thing of a typical material of a class, or of one like its own."""
        matter, thing = self.prior.typical(name), data["objects"][number]
        if alike:
            own = thing["physics_properties"]
            usual = self.prior.typical(class_of(thing))
            matter |= {key: own[key] for key in shared(usual, matter)}
        data["objects"][number] = of_matter(thing, matter, self.told(number))

    def of_class(self, data: Data, numbers: Sequence[int], name: str) -> Data:
        """A scene with things of a class, or of a usual one that they may be of."""
        changed = copy.deepcopy(data)
        for number in numbers:
            able = (n for n in (name, *INSTEAD) if self.may_be(data, number, n))
            self.turn(changed, number, next(able))
        return changed
