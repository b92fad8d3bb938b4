"""Programs whose kernels are kept in a process, for the next one that differs little.

`zygote` loads this into a process that runs linked programs one after the other. A
program whose kernels and fields are those of one before, and whatever these refer to,
gets them as they are, emptied; only the rest of it is executed.
"""

import ast
import gc
import json
import os
from collections.abc import Callable, Sequence
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

import taichi as ti

COMPILED = ("ti.kernel", "ti.func")
FIELD = ".field("
TYPE = "ti.types."
FIELDS = (ti.ScalarField, ti.MatrixField)
BETWEEN = 8  # programs between looks at what is no longer needed
NUMBERS = (bool, int, float, str, bytes, tuple, list)


class Kept(NamedTuple):
    """A program that has been loaded."""

    program: ModuleType
    shared: dict[str, Any]
    """Its kernels and fields."""
    empty: Callable[[], None]
    """Makes all numbers of its fields zero."""


class Shelf:
    """What has been loaded.

    Parameters
    ----------
    load
        Loads a program that is like none before, from its file.
    """

    def __init__(self, load: Callable[[str], ModuleType]) -> None:
        self._load = load
        self._kept: dict[str, list[Kept]] = {}

    def load(self, path: str) -> ModuleType:
        """The program of a file; it begins as it would on its own."""
        with open(path, encoding="utf-8") as file:
            tree = ast.parse(file.read())
        compiled = [node for node in tree.body if _is_compiled(node)]
        rest = [
            node for node in tree.body if node not in compiled and not _starts(node)
        ]
        kept = self._kept.setdefault("\n".join(map(ast.unparse, compiled)), [])
        for one in reversed(kept):
            again = _again(one, compiled, rest, path)
            if again is not None:
                return again
        program = self._load(path)
        ti.init = _start_no_more
        shared = {name: vars(program)[name] for node in compiled for name in _of(node)}
        fields = [field for field in shared.values() if isinstance(field, FIELDS)]
        kept.append(Kept(program, shared, _emptying(fields)))
        return program


def _start_no_more(*_arguments: Any, **_settings: Any) -> None:
    """Stand for `ti.init`, which would forget all kernels."""


def _starts(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and ast.unparse(node).startswith("ti.init(")


def _is_compiled(node: ast.stmt) -> bool:
    """Whether it is a kernel, a part of one, or fields."""
    if isinstance(node, ast.FunctionDef):
        return any(ast.unparse(one) in COMPILED for one in node.decorator_list)
    if not isinstance(node, ast.Assign):
        return False
    value = ast.unparse(node.value)
    return FIELD in value or value.startswith(TYPE)


def _emptying(fields: Sequence[Any]) -> Callable[[], None]:
    """A kernel that makes all numbers of some fields zero."""

    @ti.kernel
    def empty():  # type: ignore[no-untyped-def]  # noqa: ANN202 - none, for Taichi
        for field in ti.static(fields):
            for place in ti.grouped(field):
                if ti.static(isinstance(field, ti.ScalarField)):
                    field[place] = 0
                else:
                    field[place].fill(0)

    kernel: Callable[[], None] = empty
    return kernel


def _again(
    before: Kept, compiled: Sequence[ast.stmt], rest: list[ast.stmt], path: str
) -> ModuleType | None:
    """A program with the kernels and fields of one before, if they are the same."""
    old = vars(before.program)
    program = ModuleType(before.program.__name__)
    program.__file__ = path
    vars(program).update(before.shared)
    before.empty()
    text = compile(ast.Module(rest, []), path, "exec")
    exec(text, vars(program))  # noqa: S102 - as importing it would
    used = {
        name.id
        for node in compiled
        for name in ast.walk(node)
        if isinstance(name, ast.Name) and name.id in old
    }
    same = all(_same(old[name], vars(program).get(name)) for name in sorted(used))
    return program if same else None


def _of(node: ast.stmt) -> list[str]:
    """Names that it defines."""
    if isinstance(node, ast.FunctionDef):
        return [node.name]
    assert isinstance(node, ast.Assign)
    return [
        name.id
        for target in node.targets
        for name in ast.walk(target)
        if isinstance(name, ast.Name)
    ]


def _same(one: Any, other: Any) -> bool:
    """Whether a kernel that refers to either is the same; no if that is not known."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, FunctionType):
        code, text = one.__code__, other.__code__
        return (code.co_code, code.co_consts) == (text.co_code, text.co_consts) and all(
            _same(one.__globals__.get(name), other.__globals__.get(name))
            for name in {*code.co_names, *text.co_names}
        )
    if isinstance(one, NUMBERS):
        return bool(one == other)
    if hasattr(one, "to_list"):  # a vector or a matrix of Taichi
        return bool(one.to_list() == other.to_list())
    if hasattr(one, "tobytes"):
        return (one.shape, one.tobytes()) == (other.shape, other.tobytes())
    return False


def serve(child: ModuleType, requests: int, pipe: int, memory: int) -> None:
    """Run programs, one for each line of JSON with its `path` and `max_frames`."""
    shelf = Shelf(child._load)
    with os.fdopen(requests, "rb") as lines:
        for number, line in enumerate(lines, 1):
            given = json.loads(line)
            child.main(pipe=pipe, memory=memory, states=False, load=shelf.load, **given)
            if number % BETWEEN == 0:
                gc.collect()
