"""Fields of a program: what a feature keeps for each particle or node."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal["float", "vec2", "mat2"]


@dataclass(frozen=True)
class Field:
    """A field that a program has if it uses the name that it is bound to.

    Attributes
    ----------
    per : str
        "particle" or "node".
    kind : str
        Of its values.
    start : str
        Value at the start, or the name of a number of the material that gives it; ""
        if it is set before it is read.
    text : str
        What it is, with its unit.
    """

    per: Literal["particle", "node"]
    kind: Kind
    start: str
    text: str


def particle(kind: Kind, start: str, text: str) -> Field:
    """A field over particles."""
    return Field("particle", kind, start, text)


def node(kind: Kind, start: str, text: str) -> Field:
    """A field over nodes of the grid."""
    return Field("node", kind, start, text)
