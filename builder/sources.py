"""What of the code decides scenes and videos, without what does not: comments.

Planning the corpus takes minutes and a comment changes nothing, so the pipeline depends
on what is recorded here, not on the folder. Modules of `sim/program` are kept as they
are: the linker pastes them into programs, comments included.
"""

import hashlib
import io
import json
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from mpmworlds.files.atomic import write_atomically

PASTED: Final = "sim/program/"
_READ: Final = (".py", ".yaml", ".json")


def sources_text(root: Path, folder: str) -> str:
    """Return the hash of each source below a folder, as JSON.

    Parameters
    ----------
    root
        Folder that paths are told from.
    folder
        Path of the folder inside it.
    """
    hashes = {
        path: hashlib.sha256(_deciding(root, path).encode()).hexdigest()
        for path in _paths(root, folder)
    }
    return json.dumps(hashes, indent=1) + "\n"


def _paths(root: Path, folder: str) -> list[str]:
    found = (p for p in (root / folder).rglob("*") if p.suffix in _READ and p.is_file())
    return sorted(path.relative_to(root).as_posix() for path in found)


def _deciding(root: Path, path: str) -> str:
    text = (root / path).read_text(encoding="utf-8")
    if path.endswith(".py") and not path.startswith(PASTED):
        return code_of(text)
    return text


def code_of(source: str) -> str:
    """Return a Python source without comments and empty lines.

    It is a text, not a syntax tree, for those differ between versions of Python.
    """
    lines = source.splitlines()
    empty = set()
    for kind, _, (row, column), _, line in _tokens(source):
        if kind == tokenize.COMMENT:
            lines[row - 1] = line[:column].rstrip()
        if kind == tokenize.NL and not lines[row - 1].strip():
            empty.add(row - 1)
    return "\n".join(line for row, line in enumerate(lines) if row not in empty)


def _tokens(source: str) -> Iterator[tokenize.TokenInfo]:
    return tokenize.generate_tokens(io.StringIO(source).readline)


if __name__ == "__main__":
    _folder, _out = sys.argv[1:]
    write_atomically(Path(_out), sources_text(Path(), _folder).encode())
