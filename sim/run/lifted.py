"""Programs that differ in numbers alone, made to share their kernels.

Taichi compiles a number into a kernel, so that another stiffness is another kernel and
costs seconds. Here the numbers that scenes differ in become a field, which the program
fills when it starts. What it draws may differ from the released text in the last bit:
this is for trials, never for what is published.
"""

import ast
from dataclasses import dataclass
from typing import Final

TABLE: Final = "numbers"  # name of the field
DECORATORS: Final = ("ti.kernel", "ti.func")
# Numbers of formulas; a scene that has one of them has a kernel of its own.
FORMULAS: Final = frozenset(
    (0.0, 0.06, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 1e-9, 1e9)
)
SCALARS: Final = frozenset(("DT",))
VECTORS: Final = frozenset(("GRAVITY",))  # of two components


@dataclass(frozen=True)
class Lifted:
    """A program whose numbers are in a field."""

    text: str
    """What is run."""
    kernels: str
    """The part that is compiled: one that was compiled before starts sooner, if there
    are as many particles."""


def lifted(program_text: str) -> Lifted:
    """Text of a linked program with its numbers in a field.

    Parameters
    ----------
    program_text
        As the linker wrote it.

    Returns
    -------
    Lifted
        A program that draws the same but for rounding. Kernels are equal if scenes
        differ in numbers alone.
    """
    tree = ast.parse(program_text)
    lifting = _Lifting()
    body: list[ast.stmt] = []
    kernels: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and any(
            ast.unparse(one) in DECORATORS for one in node.decorator_list
        ):
            node.body = [lifting.visit(statement) for statement in node.body]
            kernels.append(ast.unparse(node))
        body.append(node)
    first = next(k for k, node in enumerate(body) if _starts_taichi(node))
    count = max(len(lifting.found), 1)
    declared = ast.parse(f"{TABLE} = ti.field(float, {count})").body
    values = ", ".join(lifting.found) or "0.0"
    filled = ast.parse(f"{TABLE}.from_numpy(np.float32([{values}]))").body
    last = len(body) - isinstance(body[-1], ast.If)  # what writes a file goes last
    tree.body = [*body[: first + 1], *declared, *body[first + 1 : last], *filled]
    text = ast.unparse(ast.fix_missing_locations(tree)) + "\n"
    return Lifted(text, "\n".join(kernels))


def _starts_taichi(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and ast.unparse(node).startswith("ti.init(")


class _Lifting(ast.NodeTransformer):
    """Replaces numbers in kernels, and keeps what they were as expressions."""

    def __init__(self) -> None:
        self.found: list[str] = []
        """Expressions of the module that the field is filled with, in order."""

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if isinstance(node.value, float) and node.value not in FORMULAS:
            return self._lifted(ast.unparse(node))
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in SCALARS:
            return self._lifted(node.id)
        if node.id in VECTORS:
            parts = [self._lifted(f"{node.id}[{k}]") for k in range(2)]
            return ast.Call(ast.Name("vec2", ast.Load()), parts, [])
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        node.left = self.visit(node.left)
        if not isinstance(node.op, ast.Pow):  # a power that is known costs less
            node.right = self.visit(node.right)
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        if ast.unparse(node.func) != "ti.static":
            self.generic_visit(node)
            return node
        texts = [ast.unparse(argument) for argument in node.args]
        if not all(text.startswith(("np.sin(", "np.cos(")) for text in texts):
            return node
        values: list[ast.expr] = [self._lifted(text) for text in texts]
        return values[0] if len(values) == 1 else ast.Tuple(values, ast.Load())

    def _lifted(self, text: str) -> ast.expr:
        if text not in self.found:
            self.found.append(text)
        return ast.parse(f"{TABLE}[{self.found.index(text)}]", mode="eval").body
