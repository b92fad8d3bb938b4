"""Writing a program part by part, each after the functions that it is first to need."""

import ast
import re
from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

from mpmworlds.sim.program.linking.layout import folded, indented, rows, spaced
from mpmworlds.sim.program.linking.source import Lines, library, names_read

HOOK = re.compile(r"^( *)(?:[\w, ]+ = )?hook\.(\w+)\(.*\)$")
CORNERS = re.compile(r"\[(?:\([-0-9.e]+, [-0-9.e]+\)(?:, )?){3,}\]")
WORD = re.compile(r"[A-Za-z_]\w*")


class Writer:
    """A program in the making.

    Parameters
    ----------
    places : dict of str to list of str
        Code for the hooks of the outline, as far as the scene has any.
    own : dict of str to str
        Functions that only this scene has, by name.
    """

    def __init__(self, places: dict[str, Lines], own: dict[str, str]) -> None:
        self._places = places
        self._own = own
        self._functions = library().functions.keys() | own.keys()
        self._lines: Lines = []
        self._texts: dict[str, str] = {}  # of functions, with hooks filled in
        self._kept: dict[str, list[bool]] = {}  # which parameters are read
        self._written: set[str] = set()
        self._corners: dict[str, str] = {}  # names of long lists

    def heading(self, title: str) -> None:
        """Begin a section."""
        self._lines += ["", f"# {title}"]

    def add(self, lines: Iterable[str]) -> None:
        """Write statements, after what they are the first to need."""
        text = self._named(self._called("\n".join(self._filled(lines))))
        self._need(text)
        self._lines += folded(text.splitlines())

    def define(self, *names: str) -> None:
        """Write functions and constants, if they are not there yet."""
        for name in names:
            if name in self._written:
                continue
            self._written.add(name)
            constant = library().constants.get(name)
            text = constant.text if constant else self._named(self._function(name))
            self._need(text)
            self._lines += folded(text.splitlines())

    def text(self) -> str:
        """The program so far."""
        return spaced("\n".join(self._lines))

    def _named(self, text: str) -> str:
        """A text with names for long lists of corners, which are written before it."""
        for corners in CORNERS.findall(text):
            if corners not in self._corners:
                count = len(self._corners)
                name = f"CORNERS_{count + 1}" if count else "CORNERS"
                self._corners[corners] = name
                self._lines += rows(name, corners)
            text = text.replace(corners, self._corners[corners])
        return text

    def _need(self, text: str) -> None:
        """Write the functions and constants that a text reads, in its order."""
        known = self._functions | library().constants.keys()
        read = names_read(text) & known
        self.define(*dict.fromkeys(w for w in WORD.findall(text) if w in read))

    def _function(self, name: str) -> str:
        """Text of a function of the library for this scene."""
        if name not in self._texts:
            own = self._own.get(name)
            lines = own.splitlines() if own else list(library().functions[name].lines)
            filled = self._filled(lines)
            text = self._called("\n".join(filled))
            if filled != lines:
                text, self._kept[name] = _without_idle_parameters(text)
            self._texts[name] = text
        return self._texts[name]

    def _filled(self, lines: Iterable[str]) -> Lines:
        """Lines with the code of features in place of hooks."""
        filled: Lines = []
        for line in lines:
            mark = HOOK.match(line)
            if mark is None:
                filled.append(line)
                continue
            code = self._places.get(mark.group(2), [])
            filled += indented(self._filled(code), len(mark.group(1)))
        return filled

    def _called(self, text: str) -> str:
        """A text whose calls pass what the functions of this scene take."""
        for name in sorted(names_read(text) & self._functions):
            self._function(name)
        lines = text.splitlines()
        for call in _calls(text):
            read = self._kept.get(call.name, [True])
            if all(read):
                continue
            line, kept = lines[call.line], zip(call.arguments, read, strict=False)
            passed = [argument for argument, is_read in kept if is_read]
            head, tail = line[: call.start], line[call.stop :]
            lines[call.line] = f"{head}{call.name}({', '.join(passed)}){tail}"
        return "\n".join(lines)


class Call(NamedTuple):
    """A call of a function by its name: its line, columns and arguments."""

    line: int
    start: int
    stop: int
    name: str
    arguments: tuple[str, ...]


@lru_cache(4096)
def _calls(text: str) -> list[Call]:
    """All calls in a text by name, the last first."""
    found = [
        Call(
            node.lineno - 1,
            node.col_offset,
            node.end_col_offset or 0,
            node.func.id,
            tuple(map(ast.unparse, node.args)),
        )
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    ]
    return sorted(found, reverse=True)


@lru_cache(4096)
def _without_idle_parameters(text: str) -> tuple[str, list[bool]]:
    """A function without the parameters that it never reads, and which it keeps."""
    (function,) = ast.parse(text).body
    assert isinstance(function, ast.FunctionDef)
    read = {
        node.id
        for statement in function.body
        for node in ast.walk(statement)
        if isinstance(node, ast.Name)
    }
    taken = function.args.args
    kept = [argument.arg in read for argument in taken]
    values = [None] * (len(taken) - len(function.args.defaults))
    pairs = zip(taken, [*values, *function.args.defaults], strict=True)
    left = (
        f"{ast.unparse(argument)}={ast.unparse(value)}"
        if value
        else ast.unparse(argument)
        for (argument, value), keep in zip(pairs, kept, strict=True)
        if keep
    )
    lines = text.splitlines()
    first, last = function.lineno - 1, function.body[0].lineno - 1
    lines[first:last] = [f"def {function.name}({', '.join(left)}):"]
    return "\n".join(lines), kept
