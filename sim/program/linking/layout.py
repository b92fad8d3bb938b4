"""Text as the formatter lays it out: numbers, long lines, blank lines."""

import re
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

WIDTH = 88
LAMBDA = re.compile(r"\blambda [^:]*$")  # its parameters
OPENING, CLOSING = "([{", ")]}"


def number(value: float) -> str:
    """Short text of a number that gives it back: 5e5, 2.5e-4, 0.31, 60."""
    if isinstance(value, int):
        return repr(value)
    plain = repr(float(value))
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        return plain
    digits = next(n for n in range(18) if float(f"{value:.{n}e}") == value)
    mantissa, exponent = f"{value:.{digits}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def literal(value: Any) -> str:
    """Text of numbers, and of lists and tuples of them."""
    if isinstance(value, tuple):
        inner = ", ".join(map(literal, value))
        return f"({inner},)" if len(value) == 1 else f"({inner})"
    if isinstance(value, list):
        return f"[{', '.join(map(literal, value))}]"
    if isinstance(value, str):
        return f'"{value}"'
    return number(value)


def offset(name: str, value: float) -> str:
    """Text of a name less a number."""
    if value == 0.0:
        return name
    return f"{name} - {number(value)}" if value > 0.0 else f"{name} + {number(-value)}"


def folded(lines: Iterable[str]) -> list[str]:
    """Lines of statements, those that are too long split at their last brackets."""
    return [part for line in lines for part in _fold(line)]


def _fold(line: str) -> list[str]:
    if line.lstrip().startswith("#"):
        return textwrap.wrap(line, WIDTH, subsequent_indent="# ")
    code = line.split("  #")[0]
    if len(code) <= WIDTH or code.lstrip().startswith('"""'):
        return [line]
    pair = _last_pair(code)
    if pair is None:
        return [line]
    start, stop = pair
    indent = " " * (len(line) - len(line.lstrip()))
    head, body, tail = line[: start + 1], line[start + 1 : stop], line[stop:]
    inner = f"{indent}    {body}"
    found = items(body)
    if len(inner) <= WIDTH and not (body.endswith(",") and len(found) > 1):
        return [head, inner, indent + tail]
    parts = [part for item in found for part in _fold(f"{indent}    {item},")]
    return [head, *parts, indent + tail]


def rows(name: str, text: str) -> list[str]:
    """Lines that bind a list of pairs, as many to a line as there is room for."""
    if len(f"{name} = {text}") <= WIDTH:
        return [f"{name} = {text}"]
    lines: list[list[str]] = [[]]
    for item in items(text[1:-1]):
        if len(", ".join([*lines[-1], item])) > WIDTH - len("    *[],"):
            lines.append([])
        lines[-1].append(item)
    return [f"{name} = [", *(f"    *[{', '.join(line)}]," for line in lines), "]"]


def _last_pair(code: str) -> tuple[int, int] | None:
    """Places of the last closing bracket of a line and of what opens it."""
    stop = max(code.rfind(bracket) for bracket in CLOSING)
    depth = 0
    for place in range(stop, -1, -1):
        depth += (code[place] in CLOSING) - (code[place] in OPENING)
        if depth == 0:
            return (place, stop) if stop > place + 1 else None
    return None


def items(body: str) -> list[str]:
    """Parts between the outermost commas."""
    found, depth, start = [], 0, 0
    for place, character in enumerate(body):
        depth += (character in OPENING) - (character in CLOSING)
        if character == "," and depth == 0 and not LAMBDA.search(body[start:place]):
            found.append(body[start:place].strip())
            start = place + 1
    return [item for item in [*found, body[start:].strip()] if item]


def spaced(text: str) -> str:
    """Set blank lines as the formatter does: two around definitions, else up to one.

    A comment before a definition belongs to it.
    """
    blocks: list[tuple[bool, list[str]]] = []  # whether each is a definition
    inside = False
    for line in re.sub(r"\n{3,}", "\n\n", text).splitlines():
        begins = line.startswith(("def ", "@"))
        top = bool(line) and not line.startswith((" ", ")", "]"))
        after_mark = bool(blocks) and blocks[-1][1][-1].startswith("@")
        if begins and not after_mark:
            comment = _taken_comment(blocks)
            blocks.append((True, [*comment, line]))
            inside = True
        elif top and not begins and (inside or not blocks):
            blocks.append((False, [line]))
            inside = False
        elif blocks:
            blocks[-1][1].append(line)
    parts = ["\n".join(lines).strip("\n") for _, lines in blocks]
    kinds = [kind for kind, _ in blocks]
    joined = parts[0]
    for part, kind, before in zip(parts[1:], kinds[1:], kinds, strict=False):
        joined += ("\n\n\n" if kind or before else "\n") + part
    return joined + "\n"


def _taken_comment(blocks: list[tuple[bool, list[str]]]) -> list[str]:
    """The comment that the last block ends with, taken out of it."""
    if not blocks or not blocks[-1][1][-1].startswith("#"):
        return []
    comment = [blocks[-1][1].pop()]
    if not blocks[-1][1]:
        blocks.pop()
    return comment


def indented(lines: Sequence[str], spaces: int) -> list[str]:
    """Lines further to the right."""
    return [" " * spaces + line if line else line for line in lines]
