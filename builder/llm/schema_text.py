"""The schema of scenes in few words, for a reader that pays by the word."""

from collections.abc import Iterator
from typing import Any, get_args

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from mpmworlds.sim.scene.fields import TOLD_APART_BY, Part, parts_of
from mpmworlds.sim.scene.sections import Sections

TYPES = {float: "", int: "whole ", str: "text "}
SIGNS = {Gt: "> ", Ge: ">= ", Lt: "< ", Le: "<= "}


def schema_text() -> str:
    """All keys of a scene with their limits, defaults and meanings.

    Returns
    -------
    str
        An indented outline. What can be of several types is listed once, where it comes
        first, under the key that tells the types apart.
    """
    return "\n".join(_lines(Sections, 0, set()))


def _lines(
    model: type[BaseModel], depth: int, seen: set[type[Part]], told: str = ""
) -> Iterator[str]:
    pad = "  " * depth
    for name, field in model.model_fields.items():
        if name == told:
            continue
        parts = parts_of(field.annotation)
        key = field.alias or name
        if not parts:
            yield f"{pad}{key}: {_rule(field)}"
        elif len(parts) == 1 and parts[0] not in seen:
            seen.add(parts[0])
            yield f"{pad}{key}: {field.description}"
            yield from _lines(parts[0], depth + 1, seen)
        else:
            names = ", ".join(filter(None, (_name(part)[1] for part in parts)))
            above = "as above" if set(parts) <= seen else ""
            told_of = "; ".join(filter(None, (str(field.description), names, above)))
            yield f"{pad}{key}: {told_of}"
            for part in parts:
                if part not in seen:
                    seen.add(part)
                    told, value = _name(part)
                    yield f"{pad}- {told}: {value}"
                    yield from _lines(part, depth + 1, seen, told)


def _rule(field: Any) -> str:
    """Type, limits, default and meaning of a field."""
    values = get_args(field.annotation)
    if field.annotation in TYPES:
        kind = TYPES[field.annotation]
    elif all(isinstance(value, str) for value in values):
        kind = " | ".join(values) + " "
    else:
        kind = "[[x, y], ...] " if Ellipsis in values else "[x, y] "
    limits = " and ".join(
        f"{sign}{getattr(rule, type(rule).__name__.lower()):g}"
        for rule in field.metadata
        if (sign := SIGNS.get(type(rule)))
    )
    default = field.default
    if isinstance(default, tuple):
        default = list(default)
    known = default is not PydanticUndefined
    given = f"(default {default}) " if known else ""
    rule = f"{kind}{limits} {given}".replace("  ", " ").strip()
    return f"{rule}; {field.description}" if rule else str(field.description)


def _name(part: type[Part]) -> tuple[str, str]:
    """The key that tells a part from others, and its value; nothing if nothing does."""
    for name in TOLD_APART_BY:
        if name in part.model_fields:
            values = get_args(part.model_fields[name].annotation)
            if len(values) == 1:
                return name, str(values[0])
    return "", ""
