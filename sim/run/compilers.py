"""Compilers that run the text of a program: Taichi and two forks of it.

A program says `import taichi`. For a fork, `child` lets that name stand for its module
before the program is run; nothing in the text changes.
"""

from importlib.util import find_spec
from typing import Final

MODULES: Final = {
    "taichi": "taichi",
    "quadrants": "quadrants",
    "taichi-forge": "taichi_forge",
}


def module_of(compiler: str) -> str:
    """Name of the module that a compiler is imported as.

    Raises
    ------
    ValueError
        If no compiler has this name.
    RuntimeError
        If it is not installed.
    """
    if compiler not in MODULES:
        raise ValueError(
            f"compiler = {compiler!r}, must be one of {', '.join(MODULES)}"
        )
    if find_spec(MODULES[compiler]) is None:
        raise RuntimeError(
            f"the compiler {compiler} is not installed: "
            "pip install 'mpmworlds[compilers]'"
        )
    return MODULES[compiler]
