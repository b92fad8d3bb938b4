"""Programs that differ in numbers alone, made to share their kernels.

Taichi compiles a number into a kernel, so that another stiffness is another kernel and
costs seconds. Here the numbers that scenes differ in become a field, which the program
fills when it starts. What it draws may differ from the released text in the last bit:
this is for trials, never for what is published.
"""

import ast
import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final, TypeGuard

TABLE: Final = "numbers"  # name of the field
DECORATORS: Final = ("ti.kernel", "ti.func")
# Numbers of formulas; a scene that has one of them has a kernel of its own.
FORMULAS: Final = frozenset(
    (0.0, 0.06, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 1e-9, 1e9)
)
SCALARS: Final = frozenset(("DT", "MASS"))
VECTORS: Final = frozenset(("GRAVITY",))  # of two components
COUNT: Final = "N"  # of particles
ROOM: Final = "ROOM"  # particles that fields have room for, one of a few numbers
STRIDE: Final = 1.5  # between these


@dataclass(frozen=True)
class Lifted:
    """A program whose numbers are in a field."""

    text: str
    """What is run."""
    kernels: str
    """The part that is compiled: one that was compiled before starts sooner, if there
    are about as many particles."""


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
    compiled = [node for node in tree.body if _is_compiled(node)]
    lifting = _Lifting({node.name for node in compiled})
    for function in compiled:
        function.body = [lifting.visit(statement) for statement in function.body]
    body: list[ast.stmt] = []
    roomy = _Roomy()
    for node in tree.body:
        if node not in compiled and ".field(" in ast.unparse(node):
            known = roomy.used
            roomy.visit(node)
            if roomy.used and not known:
                body += ast.parse(_ROOM).body
        body.append(node)
    first = next(k for k, node in enumerate(body) if _starts_taichi(node))
    count = max(len(lifting.found), 1)
    declared = ast.parse(f"{TABLE} = ti.field(float, {count})").body
    values = ", ".join(lifting.found) or "0.0"
    filled = ast.parse(f"{TABLE}.from_numpy(np.float32([{values}]))").body
    last = len(body) - isinstance(body[-1], ast.If)  # what writes a file goes last
    tree.body = [*body[: first + 1], *declared, *body[first + 1 : last], *filled]
    text = ast.unparse(ast.fix_missing_locations(tree)) + "\n"
    return Lifted(text, "\n".join(map(ast.unparse, compiled)))


def room_for(count: int) -> int:
    """Particles that fields of a program of so many have room for."""
    return int(STRIDE ** math.ceil(math.log(max(count, 2)) / math.log(STRIDE))) + 1


_ROOM: Final = (
    f"{ROOM} = int({STRIDE} ** np.ceil(np.log(max({COUNT}, 2)) / np.log({STRIDE}))) + 1"
)


def _is_compiled(node: ast.stmt) -> TypeGuard[ast.FunctionDef]:
    return isinstance(node, ast.FunctionDef) and any(
        ast.unparse(one) in DECORATORS for one in node.decorator_list
    )


class _Roomy(ast.NodeTransformer):
    """Lets fields have room for more particles than there are."""

    used = False

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id != COUNT:
            return node
        self.used = True
        return ast.Name(ROOM, ast.Load())


def _starts_taichi(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and ast.unparse(node).startswith("ti.init(")


class _Lifting(ast.NodeTransformer):
    """Replaces numbers in kernels, and keeps what they were as expressions.

    Parameters
    ----------
    own
        Names of functions of the program, to which scenes give numbers.
    """

    def __init__(self, own: Collection[str]) -> None:
        self._own = own
        self.found: list[str] = []
        """Expressions of the module that the field is filled with, in order."""

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if isinstance(node.value, float) and node.value not in FORMULAS:
            return self._number(node)
        return node

    def _number(self, node: ast.Constant) -> ast.expr:
        """Each has a place of its own, though it be as large as another one."""
        self.found.append(ast.unparse(node))
        return self._at(len(self.found) - 1)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in SCALARS:
            return self._lifted(node.id)
        if node.id == COUNT:
            return ast.Call(ast.Name("int", ast.Load()), [self._lifted(COUNT)], [])
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
        called = ast.unparse(node.func)
        if called != "ti.static":
            if called in self._own:
                node.args = [
                    self._number(a)
                    if isinstance(a, ast.Constant) and isinstance(a.value, float)
                    else a
                    for a in node.args
                ]
            self.generic_visit(node)
            return node
        texts = [ast.unparse(argument) for argument in node.args]
        if not all(text.startswith(("np.sin(", "np.cos(")) for text in texts):
            return node
        values: list[ast.expr] = [self._lifted(text) for text in texts]
        return values[0] if len(values) == 1 else ast.Tuple(values, ast.Load())

    def _lifted(self, text: str) -> ast.expr:
        """The place of an expression, which is the same wherever it stands."""
        if text not in self.found:
            self.found.append(text)
        return self._at(self.found.index(text))

    @staticmethod
    def _at(place: int) -> ast.expr:
        return ast.parse(f"{TABLE}[{place}]", mode="eval").body
