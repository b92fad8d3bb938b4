"""The grammar of sample ids, which say their own lineage.

`p0123` is a parent, `p0123-c4` a child of it, `p0123-c4-n07` a perturbation of that
child and `p0123-n07` one of the parent itself. `s07` is a hand-made seed scene: it
stands where a parent stands, and may have children and perturbations likewise.
"""

import re
from dataclasses import dataclass
from typing import Final

SAMPLE_KINDS: Final = ("seed", "parent", "child", "perturbation")

_ID = re.compile(
    r"(?P<root>p(?:\d{4}|[1-9]\d{4,})|s(?:\d{2}|[1-9]\d{2,}))"
    r"(?:-c(?P<child>0|[1-9]\d*))?"
    r"(?:-n(?P<perturbation>\d{2}|[1-9]\d{2,}))?",
    re.ASCII,
)


class SampleIdError(ValueError):
    """A text that is no sample id."""


@dataclass(frozen=True)
class SampleId:
    """A sample id taken apart.

    Attributes
    ----------
    family
        Id of the root: a parent or a seed, e.g. `p0123` or `s07`.
    child
        Number of the child of the root that the sample is or was made from, or None.
    perturbation
        Number of the perturbation that the sample is, or None for a template.
    """

    family: str
    child: int | None = None
    perturbation: int | None = None

    @classmethod
    def parse(cls, text: str) -> "SampleId":
        """Take an id apart.

        Raises
        ------
        SampleIdError
            If the text does not follow the grammar. Every sample has exactly one
            spelling, so padding that is missing or superfluous is an error as well.
        """
        match = _ID.fullmatch(text)
        if match is None:
            raise SampleIdError(
                f"sample id {text!r}: must be a parent 'p0123' or a seed 's07', then "
                "optionally a child '-c4', then optionally a perturbation '-n07' "
                "(parents padded to 4 digits, seeds and perturbations to 2)"
            )
        child, perturbation = match["child"], match["perturbation"]
        return cls(
            family=match["root"],
            child=None if child is None else int(child),
            perturbation=None if perturbation is None else int(perturbation),
        )

    def __str__(self) -> str:
        """Return the one spelling of the id."""
        child = "" if self.child is None else f"-c{self.child}"
        number = "" if self.perturbation is None else f"-n{self.perturbation:02d}"
        return self.family + child + number

    @property
    def template(self) -> str:
        """Id of the seed, parent or child that a perturbation perturbs, else itself."""
        return str(SampleId(self.family, self.child))

    @property
    def kind(self) -> str:
        """Which of `SAMPLE_KINDS` the sample is."""
        if self.perturbation is not None:
            return "perturbation"
        if self.child is not None:
            return "child"
        return "seed" if self.is_of_seed_family else "parent"

    @property
    def made_from(self) -> str:
        """Id of the sample that this one was made from, "" for seeds and parents."""
        if self.perturbation is not None:
            return self.template
        return "" if self.child is None else self.family

    @property
    def is_of_seed_family(self) -> bool:
        """Whether the root is a hand-made seed."""
        return self.family.startswith("s")
