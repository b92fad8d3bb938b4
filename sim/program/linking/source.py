"""The sources that programs are pasted from: functions, hooks, constants and fields.

Names are unique over all modules, so that a name in pasted code tells what it needs.
"""

import ast
import inspect
import symtable
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import import_module
from types import ModuleType

from mpmworlds.sim.program import features
from mpmworlds.sim.program.fields import Field

ROOMS = ("contacts", "emissions", "materials", "motions", "shapes")
COMMON = (
    *("angles", "deformation", "drawing", "emission", "motion", "solids"),
    *("contact", "material", "shape"),
)
OUTLINE = "mpmworlds.sim.program.outline"
Lines = list[str]


class SourceError(ValueError):
    """A source that cannot be pasted."""


@dataclass(frozen=True)
class Piece:
    """A function, or one constant with its comment, as it stands in its module.

    Attributes
    ----------
    name : str
        What it defines.
    lines : tuple of str
        Its text, without the decorator of a hook.
    place : str
        Where in the outline a hook belongs, "" if it is none.
    """

    name: str
    lines: tuple[str, ...]
    place: str = ""

    @property
    def text(self) -> str:
        """Its lines as one text."""
        return "\n".join(self.lines)

    @property
    def parameters(self) -> list[str]:
        """Names of the parameters of a function."""
        return [argument.arg for argument in parsed(self).args.args]


@dataclass(frozen=True)
class Library:
    """All that programs are made of, by name.

    Attributes
    ----------
    functions, constants : dict of str to Piece
        In the order of their modules.
    hooks : dict of (str, str) to Piece
        By the name of their module and their own.
    fields : dict of str to Field
        By the name that they are bound to.
    """

    functions: dict[str, Piece]
    constants: dict[str, Piece]
    hooks: dict[tuple[str, str], Piece]
    fields: dict[str, Field]


@cache
def library() -> Library:
    """Read all sources once.

    Raises
    ------
    SourceError
        If two modules define the same name.
    """
    found = Library({}, {}, {}, {})
    for module in _modules():
        own = module.__name__.rpartition(".")[2]
        for piece in _pieces(module):
            if piece.place:
                found.hooks[own, piece.name] = piece
                continue
            coded = piece.lines[0].startswith(("def ", "@"))
            kind = found.functions if coded else found.constants
            if piece.name in found.functions | found.constants:
                raise SourceError(f"{module.__name__} defines {piece.name} once more")
            kind[piece.name] = piece
        for name, item in vars(module).items():
            if isinstance(item, Field):
                found.fields[name] = item
    return found


def _modules() -> list[ModuleType]:
    names = [f"{features.__name__}.{name}" for name in COMMON]
    common = [import_module(name) for name in (*names, OUTLINE)]
    return common + [m for room in ROOMS for m in features.modules_of(room)]


def _pieces(module: ModuleType) -> Iterable[Piece]:
    text = inspect.getsource(module)
    lines = text.splitlines()
    for node in ast.parse(text).body:
        match node:
            case ast.FunctionDef():
                if _is_typed(node):
                    continue
                marks = [ast.unparse(mark) for mark in node.decorator_list]
                place = next((m[5:] for m in marks if m.startswith("hook.")), "")
                first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
                own = lines[first - 1 + bool(place) : node.end_lineno]
            case ast.Assign(targets=[ast.Name(id=name)]) if _is_number(node.value):
                own = lines[node.lineno - 1 : node.end_lineno]
                yield Piece(name, tuple(own))
                continue
            case _:
                continue
        yield Piece(node.name, tuple(own), place)


def _is_typed(node: ast.FunctionDef) -> bool:
    """Whether a function is for the schema: what programs get has no annotations.

    But Taichi reads those of kernels and templates.
    """
    return node.returns is not None


def _is_number(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float)


@lru_cache(1)
def _table(text: str) -> symtable.SymbolTable:
    return symtable.symtable(text, "text", "exec")


@lru_cache(4096)
def names_read(text: str) -> frozenset[str]:
    """Global names that a text reads, in whichever scope."""
    used: set[str] = set()
    scopes = [_table(text)]
    while scopes:
        scope = scopes.pop()
        scopes += scope.get_children()
        outermost = scope.get_type() == "module"
        for symbol in scope.get_symbols():
            if symbol.is_referenced() and (outermost or symbol.is_global()):
                used.add(symbol.get_name())
    return frozenset(used)


def names_bound(text: str) -> frozenset[str]:
    """Names that a text assigns, defines or imports at its top."""
    symbols = _table(text).get_symbols()
    return frozenset(
        s.get_name() for s in symbols if s.is_assigned() or s.is_imported()
    )


@cache
def parsed(piece: Piece) -> ast.FunctionDef:
    """Syntax tree of a function or hook; not to be changed."""
    (function,) = ast.parse(piece.text).body
    assert isinstance(function, ast.FunctionDef)
    return function


def body_of(piece: Piece, numbers: Mapping[str, str]) -> Lines:
    """Statements of a hook, with texts in place of the parameters that `numbers` names.

    Docstring and `return` say what the hook is and sets; neither is pasted.
    """
    function = parsed(piece)
    statements = function.body
    if ast.get_docstring(function):
        statements = statements[1:]
    if isinstance(statements[-1], ast.Return):
        statements = statements[:-1]
    if not statements:
        return []
    lines = _substituted(piece, numbers)
    indent = statements[0].col_offset
    end = statements[-1].end_lineno
    return [line[indent:] for line in lines[statements[0].lineno - 1 : end]]


def result_of(piece: Piece, numbers: Mapping[str, str]) -> str:
    """What a hook returns, with texts in place of parameters."""
    last = parsed(piece).body[-1]
    assert isinstance(last, ast.Return)
    lines = _substituted(piece, numbers)
    return lines[last.lineno - 1].strip().removeprefix("return ")


def _substituted(piece: Piece, numbers: Mapping[str, str]) -> Lines:
    """Lines of a hook with texts in place of the names that `numbers` has."""
    lines = list(piece.lines)
    for number, start, stop, name in _names(piece):
        if name in numbers:
            line = lines[number]
            lines[number] = line[:start] + numbers[name] + line[stop:]
    return lines


@cache
def _names(piece: Piece) -> list[tuple[int, int, int, str]]:
    """Lines and columns of all names in the body of a hook, the last first."""
    found = [
        (node.lineno - 1, node.col_offset, node.end_col_offset or 0, node.id)
        for statement in parsed(piece).body
        for node in ast.walk(statement)
        if isinstance(node, ast.Name)
    ]
    return sorted(found, reverse=True)
