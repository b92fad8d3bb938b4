"""A table as text cells, and the forms it is written in."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

NONE: Final = "–"  # noqa: RUF001 - the dash that stands for no number
LATEX: Final[Mapping[str, str]] = MappingProxyType(
    {
        "\\": r"\textbackslash{}",
        "&": r"\&",
        "%": r"\%",
        "$": r"\$",
        "#": r"\#",
        "_": r"\_",
        "{": r"\{",
        "}": r"\}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        '"': r"\textquotedbl{}",
        "±": r"$\pm$",
        "↑": r"$\uparrow$",
        "↓": r"$\downarrow$",
        NONE: "--",
        "\n": " ",
    }
)
MINUS: Final = re.compile(r"(?<!\w)-(?=\d)")  # of a number, where a hyphen is too short


@dataclass(frozen=True)
class Group:
    """Rows of a table under a heading of their own."""

    heading: str
    """What they have in common; empty if the table has one group."""
    rows: tuple[tuple[str, ...], ...]
    """As many cells in each as there are columns."""


@dataclass(frozen=True)
class Table:
    """A table of any form."""

    name: str
    """Label, of letters, digits and dashes."""
    title: str
    """What it shows."""
    columns: tuple[str, ...]
    """Headings of its columns."""
    groups: tuple[Group, ...]
    """Its rows."""
    texts: int
    """How many columns from the left are no numbers."""
    notes: tuple[str, ...] = ()
    """What one must know to read it."""


def plain(table: Table) -> str:
    """Write a table for a terminal."""
    rows = [table.columns, *(row for group in table.groups for row in group.rows)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [table.title]
    for row in rows if len(rows) > 1 else ():
        cells = [
            cell.ljust(width) if column < table.texts else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join([*lines, *table.notes]) + "\n"


def markdown(table: Table) -> str:
    """Write a table as GitHub Markdown."""
    lines = [f"**{escape_markdown(table.title)}**", ""]
    rules = ["---"] * table.texts + ["--:"] * (len(table.columns) - table.texts)
    lines += [_pipes(map(escape_markdown, table.columns)), _pipes(rules)]
    for group in table.groups:
        if group.heading:
            blank = [""] * (len(table.columns) - 1)
            lines.append(_pipes([f"*{escape_markdown(group.heading)}*", *blank]))
        lines += [_pipes(map(escape_markdown, row)) for row in group.rows]
    for note in table.notes:
        lines += ["", escape_markdown(note)]
    return "\n".join(lines) + "\n"


def latex(table: Table) -> str:
    """Write a table as LaTeX; it needs booktabs and graphicx."""
    count = len(table.columns)
    lines = [
        r"\begin{table*}",
        r"\centering",
        rf"\caption{{{escape(' '.join((f'{table.title}.', *table.notes)))}}}",
        rf"\label{{tab:{table.name}}}",
        r"\resizebox{\textwidth}{!}{%",
        rf"\begin{{tabular}}{{{'l' * table.texts}{'r' * (count - table.texts)}}}",
        r"\toprule",
        _ampersands(table.columns),
    ]
    for group in table.groups:
        lines.append(r"\midrule")
        if group.heading:
            heading = rf"\emph{{{escape(group.heading)}}}"
            lines.append(rf"\multicolumn{{{count}}}{{l}}{{{heading}}} \\")
        lines += [_ampersands(row) for row in group.rows]
    lines += [r"\bottomrule", r"\end{tabular}}", r"\end{table*}"]
    return "\n".join(lines) + "\n"


def escape(text: str) -> str:
    """Text as LaTeX shows it."""
    return "".join(LATEX.get(letter, letter) for letter in text)


def csv_text(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Write rows as CSV; None is an empty cell, and a number has all its digits."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return buffer.getvalue()


def escape_markdown(text: str) -> str:
    """Text as Markdown shows it."""
    plain = text.replace("\\", "\\\\").replace("|", "\\|").replace("\n", " ")
    for letter in "*_<`":
        plain = plain.replace(letter, f"\\{letter}")
    return plain


def _pipes(cells: "map[str] | Sequence[str]") -> str:
    return "| " + " | ".join(cells) + " |"


def _ampersands(cells: Sequence[str]) -> str:
    """A row; a cell that starts with a bracket is no option of the line before."""
    first = "{}" if cells[0].startswith(("[", "*")) else ""
    return first + " & ".join(map(_cell, cells)) + r" \\"


def _cell(text: str) -> str:
    return MINUS.sub("$-$", escape(text))
