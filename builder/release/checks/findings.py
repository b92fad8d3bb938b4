"""A finding: what is wrong with which row of which file, and what to do."""

import dataclasses
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from mpmworlds.files.text import shown

FETCH: Final = "fetch the file again, or build the release again"
RENDER: Final = "do not use the row; fetch the file again, or build the release again"
MOST: Final = 100  # findings of one kind that are listed
_LONGEST: Final = {"file": 500, "row": 60, "fault": 500, "remedy": 300}  # characters


@dataclass(frozen=True)
class Finding:
    """Something in a release that is not as it must be.

    Texts of the release may be in it, so what a terminal would obey is escaped, and
    what is long is cut.
    """

    file: str
    """Path inside the release; empty if it is about all of it."""
    fault: str
    """What is wrong."""
    remedy: str = FETCH
    """What to do."""
    row: str = ""
    """Id of the row; empty if it is about the file."""

    def __post_init__(self) -> None:
        for name, longest in _LONGEST.items():
            object.__setattr__(self, name, shown(getattr(self, name), longest))

    def __str__(self) -> str:
        """Return one line."""
        start = [part for part in (self.file, self.row) if part]
        return ": ".join([*start, f"{self.fault}; {self.remedy}"])

    def as_dict(self) -> dict[str, str]:
        """Return it as plain data."""
        return dataclasses.asdict(self)


def the_first(findings: Iterable[Finding], file: str) -> Iterator[Finding]:
    """Yield the first findings, and one that says how many more there are."""
    more = 0
    for number, finding in enumerate(findings):
        if number < MOST:
            yield finding
        else:
            more += 1
    if more:
        yield Finding(file, f"and {more} more findings of this kind")
