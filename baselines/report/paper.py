"""The paper's own numbers, as reference data beside ours."""

from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Final

import yaml

FILE: Final = "paper.yaml"


@dataclass(frozen=True)
class PaperRow:
    """What the paper reports of one system in one regime."""

    system: str
    """Name of the system in the paper."""
    regime: str
    """Regime, by its name here."""
    split: str | None
    """Split, by its name here; None if it is not known."""
    table: str | None
    """Label of its table; None if it is not known."""
    values: dict[str, float]
    """Metric -> mean over the samples that were valid."""
    note: str = ""
    """What is odd about it."""


@dataclass(frozen=True)
class Statement:
    """Something else that is known of the paper's results."""

    about: str
    """Of what."""
    value: str
    """How much."""
    read_from_figure: bool
    """Whether a third party read it from a figure, unchecked."""


@dataclass(frozen=True)
class Paper:
    """All that is shipped of the paper's results."""

    title: str
    """Its name."""
    source: str
    """Where it is."""
    rows: tuple[PaperRow, ...] = field(default=())
    """Means, sorted as in the file."""
    statements: tuple[Statement, ...] = field(default=())
    """Other numbers."""

    def rows_for(self, split: str) -> list[PaperRow]:
        """Rows of a split, and those whose split is not known."""
        return [row for row in self.rows if row.split in (None, split)]


@cache
def paper() -> Paper:
    """Read the reference data of the package."""
    text = files(__package__).joinpath(FILE).read_text("utf-8")
    data = yaml.safe_load(text)
    return Paper(
        title=data["paper"]["title"],
        source=data["paper"]["source"],
        rows=tuple(PaperRow(**row) for row in data["scores"]),
        statements=tuple(Statement(**told) for told in data["statements"]),
    )
