"""Rows of a manifest by what is known of them: ids, splits, kinds and expressions.

An expression compares columns with text and numbers, for example
``material == 'sand' and num_objects >= 3``. It is parsed and checked, never executed.
"""

import ast
import json
import operator
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import pairwise
from typing import Any, Final

from mpmworlds.builder.plan.manifest import ManifestRow
from mpmworlds.splits.draw import draw

Predicate = Callable[[ManifestRow], bool]

SETS: Final[dict[str, Callable[[ManifestRow], Collection[str]]]] = {
    "material": operator.attrgetter("materials"),
    "object_type": operator.attrgetter("object_types"),
    "seed": lambda row: [*row.seeds, *(name.partition("_")[0] for name in row.seeds)],
}
TEXTS: Final[dict[str, Callable[[ManifestRow], str]]] = {
    "id": operator.attrgetter("id"),
    "kind": operator.attrgetter("kind"),
    "split": operator.attrgetter("split"),
    "edit": lambda row: json.loads(row.edit)["operator"] if row.edit else "",
    "family_id": operator.attrgetter("family_id"),
    "parent_id": operator.attrgetter("parent_id"),
}
CLOSED: Final = (*SETS, "kind", "split", "edit")  # whose values are few and known
NUMBERS: Final = ("num_objects", "num_materials")
ALLOWED: Final = (
    f"allowed are the sets {', '.join(SETS)} (== contains, != does not, "
    f"in [..] has one of), the texts {', '.join(TEXTS)}, "
    f"the numbers {', '.join(NUMBERS)}, "
    "< <= > >= == != in, not in, and, or, not, parentheses, 'text' and numbers"
)
_COMPARISONS: Final = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_NAMED_AT_MOST = 3  # unknown ids that an error names


class SelectionError(ValueError):
    """A selection that cannot be meant."""


# ---- expressions


class _Refused(Exception):
    """A part of an expression that is not allowed, and why."""

    def __init__(self, node: ast.AST, reason: str) -> None:
        super().__init__(reason)
        self.column = getattr(node, "col_offset", 0) + 1


@dataclass(frozen=True)
class _Operand:
    """A side of a comparison.

    Its kind is "text", "number", "set", "list of text" or "list of numbers".
    """

    kind: str
    value: Callable[[ManifestRow], Any]


def parse(expression: str) -> Predicate:
    """Turn an expression into a function that says whether a row satisfies it.

    Parameters
    ----------
    expression
        For example ``material in ['sand', 'snow'] and not num_objects > 4``.

    Returns
    -------
    callable
        Manifest row -> bool.

    Raises
    ------
    SelectionError
        If the expression is not one. Names it, the column, and what is allowed.
    """
    text = expression.strip()
    try:
        return _predicate(ast.parse(text, mode="eval").body)
    except _Refused as error:
        column, reason = error.column, str(error)
    except SyntaxError as error:
        column, reason = error.offset or 1, error.msg
    except (ValueError, MemoryError, RecursionError):  # a NUL, or nested too deeply
        column, reason = 1, "it cannot be read"
    raise SelectionError(f"expression {text!r}, column {column}: {reason}; {ALLOWED}")


def _predicate(node: ast.expr) -> Predicate:
    match node:
        case ast.BoolOp(op=ast.And(), values=values):
            parts = [_predicate(value) for value in values]
            return lambda row: all(part(row) for part in parts)
        case ast.BoolOp(values=values):
            parts = [_predicate(value) for value in values]
            return lambda row: any(part(row) for part in parts)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            negated = _predicate(operand)
            return lambda row: not negated(row)
        case ast.Compare(left=left, ops=ops, comparators=rights):
            lefts = [left, *rights]
            parts = [
                _comparison(*part) for part in zip(lefts, ops, rights, strict=False)
            ]
            return lambda row: all(part(row) for part in parts)
    raise _Refused(node, f"{ast.unparse(node)} is no comparison")


def _comparison(left: ast.expr, op: ast.cmpop, right: ast.expr) -> Predicate:
    a, b = _operand(left), _operand(right)
    pair = (a.kind, b.kind)
    if isinstance(op, ast.In | ast.NotIn):
        wanted = isinstance(op, ast.In)
        if pair == ("set", "list of text"):
            return lambda row: bool(set(a.value(row)) & set(b.value(row))) == wanted
        if pair in (("text", "set"), ("text", "list of text")) or (
            pair == ("number", "list of numbers")
        ):
            return lambda row: (a.value(row) in b.value(row)) == wanted
    elif isinstance(op, ast.Eq | ast.NotEq) and sorted(pair) == ["set", "text"]:
        wanted = isinstance(op, ast.Eq)
        one, many = (a, b) if a.kind == "text" else (b, a)
        return lambda row: (one.value(row) in many.value(row)) == wanted
    elif type(op) in _COMPARISONS and pair in (("text", "text"), ("number", "number")):
        compare = _COMPARISONS[type(op)]
        return lambda row: bool(compare(a.value(row), b.value(row)))
    sides = f"{ast.unparse(left)} is a {a.kind}, {ast.unparse(right)} a {b.kind}"
    raise _Refused(left, f"cannot be compared like this: {sides}")


def _operand(node: ast.expr) -> _Operand:
    match node:
        case ast.Name(id=name):
            return _column(node, name)
        case ast.List(elts=items) | ast.Tuple(elts=items) if items:
            values = [_literal(item) for item in items]
            if all(isinstance(value, str) for value in values):
                return _Operand("list of text", lambda _: values)
            if not any(isinstance(value, str) for value in values):
                return _Operand("list of numbers", lambda _: values)
            raise _Refused(node, "a list holds texts or numbers, not both")
    value = _literal(node)
    return _Operand("text" if isinstance(value, str) else "number", lambda _: value)


def _column(node: ast.expr, name: str) -> _Operand:
    if name in SETS:
        return _Operand("set", SETS[name])
    if name in TEXTS:
        return _Operand("text", TEXTS[name])
    if name in NUMBERS:
        return _Operand("number", operator.attrgetter(name))
    near = get_close_matches(name, [*SETS, *TEXTS, *NUMBERS], 1)
    hint = f", perhaps {near[0]}" if near else "; text stands in quotes"
    raise _Refused(node, f"there is no column {name}{hint}")


def _literal(node: ast.expr) -> str | float:
    match node:
        case ast.Constant(value=str() | int() | float() as value):
            if not isinstance(value, bool):
                return value
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=value)):
            if isinstance(value, int | float) and not isinstance(value, bool):
                return -value
    raise _Refused(node, f"{ast.unparse(node)} is no text, number or column")


def check_values(expression: str, rows: Sequence[ManifestRow]) -> None:
    """Refuse values that no row has, which are most likely misspelt.

    Parameters
    ----------
    expression
        An expression that `parse` takes.
    rows
        All rows.

    Raises
    ------
    SelectionError
        If it compares one of the columns `CLOSED` with such a value. Names those that
        there are.
    """
    for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            for pair in pairwise(sides):
                for name, other in (pair, pair[::-1]):
                    if isinstance(name, ast.Name) and name.id in CLOSED:
                        _check_value(name.id, other, rows)


def _check_value(name: str, node: ast.expr, rows: Sequence[ManifestRow]) -> None:
    texts = [part.value for part in ast.walk(node) if isinstance(part, ast.Constant)]
    if not texts:
        return
    if name in SETS:
        known = sorted({value for row in rows for value in SETS[name](row)})
    else:
        known = sorted({TEXTS[name](row) for row in rows})
    for text in texts:
        if text not in known:
            near = get_close_matches(str(text), known, 1)
            hint = f"perhaps {near[0]!r}; " if near else ""
            raise SelectionError(
                f"no row has {name} {text!r}; {hint}there are "
                f"{', '.join(value for value in known if value)}"
            )


# ---- selections


def select(
    rows: Sequence[ManifestRow],
    ids: Collection[str] = (),
    split: str | None = None,
    kind: str | None = None,
    where: str | None = None,
    sample: int | None = None,
    limit: int | None = None,
) -> list[ManifestRow]:
    """Select the rows that satisfy everything that is asked.

    Parameters
    ----------
    rows
        All rows of a manifest.
    ids
        Ids to keep; all if there are none.
    split, kind
        Split and kind to keep; all if None.
    where
        Expression, see ``parse``.
    sample
        How many of these rows to draw at random. The draw belongs to the id, so it is
        always the same, and a smaller sample is the beginning of a larger one.
    limit
        Keep this many of the first.

    Returns
    -------
    list of ManifestRow
        In the order of the manifest, or of the draw.

    Raises
    ------
    SelectionError
        If an id or split is unknown, a number is not positive, or the expression is
        none.
    """
    _check_ids(ids, rows)
    splits = sorted({row.split for row in rows})
    if split is not None and split not in splits:
        raise SelectionError(f"split {split!r}: there are {', '.join(splits)}")
    for name, number in (("sample", sample), ("limit", limit)):
        if number is not None and number < 1:
            raise SelectionError(f"{name} = {number}, must be at least 1")
    wanted, holds = set(ids), parse(where) if where is not None else lambda _: True
    if where is not None:
        check_values(where, rows)
    found = [
        row
        for row in rows
        if (not wanted or row.id in wanted)
        and split in (None, row.split)
        and kind in (None, row.kind)
        and holds(row)
    ]
    if sample is not None:
        found = sorted(found, key=lambda r: draw("materialise", "sample", r.id))[
            :sample
        ]
    return found[:limit]


def _check_ids(ids: Iterable[str], rows: Sequence[ManifestRow]) -> None:
    known = {row.id for row in rows}
    unknown = [name for name in dict.fromkeys(ids) if name not in known]
    if not unknown:
        return
    named = [_named(name, known) for name in unknown[:_NAMED_AT_MOST]]
    more = len(unknown) - len(named)
    rest = f" and {more} more" if more else ""
    raise SelectionError(f"not in the manifest: {', '.join(named)}{rest}")


def _named(name: str, known: Collection[str]) -> str:
    """Quote an unknown id with the known one that is nearest to it."""
    # Within the family if there is one, else among the roots: a fraction of all ids.
    family = name.partition("-")[0]
    relatives = [i for i in known if i.partition("-")[0] == family]
    roots = (i for i in known if "-" not in i)
    near = get_close_matches(name, sorted(relatives or roots), 1)
    return f"{name!r} (nearest: {near[0]})" if near else repr(name)
