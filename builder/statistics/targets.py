"""What the paper publishes about its corpus, and how near to it this one must come.

Source: the statistics section of the paper, arXiv 2606.01538. Its histograms of
materials, objects per scene and object types are drawn in a figure and not given as
numbers; a third party has read shares of materials from it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from mpmworlds.builder.statistics.counts import Statistics

PAPER_COUNTS: Final = {"scenes": 95_805, "templates": 9_204, "perturbations": 86_601}
PAPER_ORDER: Final = (("liquid", "elastic"), ("snow",), ("sand", "viscoplastic"))
NOT_PUBLISHED: Final = (
    "The paper shows materials, objects per scene and object types in a figure only,\n"
    "and publishes no numbers for them. Those marked * a third party has read from\n"
    "figure 3b; this corpus keeps the rare families large enough to report on."
)


@dataclass(frozen=True)
class Mix:
    """A family of materials, and the share that templates must have of it.

    Attributes
    ----------
    family
        Its name.
    least, most
        Shares of this corpus that are allowed.
    read
        Share in the paper, read from its figure by a third party.
    """

    family: str
    least: float
    most: float
    read: float

    @property
    def wanted(self) -> str:
        """What is allowed, in words."""
        allowed = f"{self.least:.0%} to {self.most:.0%}"
        return f"{allowed} (the paper's figure: {self.read:.1%}*)"


MIX: Final = (
    Mix("liquid", 0.32, 0.36, 0.345),
    Mix("elastic/plastic", 0.28, 0.34, 0.327),
    Mix("snow", 0.17, 0.24, 0.242),
    Mix("visco", 0.05, 0.10, 0.055),
    Mix("sand", 0.05, 0.10, 0.03),
)


@dataclass(frozen=True)
class Target:
    """A published number and how far from it a corpus may be.

    Attributes
    ----------
    what
        The quantity.
    paper, tolerance
        Published value, and the largest deviation from it, in the same unit.
    form
        Format of the value, such as ``.1%``.
    value
        Function: statistics -> value of this corpus.
    """

    what: str
    paper: float
    tolerance: float
    form: str
    value: Callable[[Statistics], float]

    def text(self, value: float) -> str:
        """Write a value of this quantity."""
        return format(value, self.form)

    @property
    def wanted(self) -> str:
        """What is allowed, in words."""
        if not self.tolerance:
            return self.text(self.paper)
        return f"{self.text(self.paper)} +- {self.text(self.tolerance)}"

    def holds(self, found: Statistics) -> bool:
        """Whether a corpus is near enough; the limits themselves are allowed."""
        return abs(self.value(found) - self.paper) <= self.tolerance + 1e-9


TARGETS: Final = (
    Target("objects per scene, median", 3.0, 0.0, "g", lambda s: s.median_objects),
    Target("objects per scene, mean", 2.9, 0.1, ".3g", lambda s: s.mean_objects),
    Target("two materials or more", 0.225, 0.015, ".1%", lambda s: s.two_materials),
    Target("three materials or more", 0.053, 0.008, ".1%", lambda s: s.three_materials),
)


@dataclass(frozen=True)
class Verdict:
    """Whether a target holds.

    Attributes
    ----------
    what
        The quantity.
    found, wanted
        What it is and what it must be, in words.
    holds
        Whether it is.
    """

    what: str
    found: str
    wanted: str
    holds: bool


def verdicts(found: Statistics) -> list[Verdict]:
    """Judge the statistics of a corpus by the paper's.

    Parameters
    ----------
    found
        Statistics of the corpus.

    Returns
    -------
    list of Verdict
        One per target: those of `TARGETS` and `MIX`, then the order of the materials.
    """
    numbers = [
        Verdict(t.what, t.text(t.value(found)), t.wanted, t.holds(found))
        for t in TARGETS
    ]
    for mix in MIX:
        share = found.share(mix.family)
        holds = mix.least <= share <= mix.most
        what = f"matter of templates, {mix.family}"
        numbers.append(Verdict(what, f"{share:.1%}", mix.wanted, holds))
    named = {name for tier in PAPER_ORDER for name in tier}
    order = ", ".join(name for name in found.materials if name in named)
    wanted = " > ".join(" and ".join(tier) for tier in PAPER_ORDER)
    holds = order_holds(found.materials)
    return [*numbers, Verdict("order of materials", order, wanted, holds)]


def order_holds(materials: Mapping[str, int]) -> bool:
    """Return whether materials are as frequent, relative to each other, as published.

    Parameters
    ----------
    materials
        Scenes with each material.

    Returns
    -------
    bool
        True if each material of a tier of `PAPER_ORDER` is in more scenes than each of
        the next tier, and no material at all is in more than those of the first.
    """
    tiers = [[materials.get(name, 0) for name in tier] for tier in PAPER_ORDER]
    falls = all(min(a) > max(b) for a, b in pairwise(tiers))
    others = [n for name, n in materials.items() if name not in PAPER_ORDER[0]]
    return falls and min(tiers[0]) > max(others, default=0)
