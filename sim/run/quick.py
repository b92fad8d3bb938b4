"""Let Taichi compile sooner what it compiles.

It lays out the source of every expression for its error messages, and reads and wraps
the text of a function at each of its calls: half of its time in Python. Here it reads a
text once, and a message names a line and shows it. What it compiles, and so every bit
of a result, stays the same.
"""

import importlib
import textwrap
from functools import cache
from types import SimpleNamespace
from typing import Any


def quicken() -> None:
    """Change Taichi in this process."""
    kernels: Any = importlib.import_module("taichi.lang.kernel_impl")
    kernels.getsourcelines = cache(kernels.getsourcelines)
    kernels.textwrap = SimpleNamespace(
        fill=cache(textwrap.fill), dedent=cache(textwrap.dedent)
    )
    utilities: Any = importlib.import_module("taichi.lang.ast.ast_transformer_utils")
    utilities.ASTTransformerContext.get_pos_info = _place


def _place(context: Any, node: Any) -> str:
    """File, line and function of an expression, and its line."""
    line = node.lineno + context.lineno_offset
    name = context.func.func.__name__
    text: str = context.src[node.lineno - 1]
    return f'File "{context.file}", line {line}, in {name}:\n{text}\n'
