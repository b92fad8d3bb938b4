"""The linker: from a scene to the text of its standalone program.

`skeleton.py` is a complete program. Between `# region NAME` and `# endregion` stands
what depends on the scene; `emit` writes it anew. Text in a `# region if FEATURE` stays
only where the scene has the feature. The functions that the result uses are pasted from
`physics`, as they stand there, in place of the imports.
"""

import ast
import builtins
import re
import symtable
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any

from mpmworlds.sim import emit
from mpmworlds.sim.scene.scene import SCHEMA, Scene

REGIONS: dict[str, Callable[[Scene], str]] = {
    "scene": emit.emit_scene,
    "shapes": emit.emit_shapes,
    "emission": emit.emit_emission,
    "materials": emit.emit_materials,
    "motion": emit.emit_motion,
}
MARK = re.compile(r"^( *)# (region (.*)|endregion)$")
PHYSICS = "# physics\n"  # where the functions of the library go
MATH = "from taichi.math import "
SIGN = re.compile(r"(?<=[=(\[])-(?=0)|(?<=, )-(?=0)")
RECENT = 256  # outlines that are remembered, for scenes that differ in numbers only
STUB = " = ".join(name.upper() for name in emit.SECTIONS) + " = 0\n"  # of a scene
NUMBER = re.compile(r"(?<![\w.])\d[\d.]*(?:e[-+]?\d+)?")


class LinkError(ValueError):
    """A program that would not run: it uses a name that nothing defines."""


@dataclass(frozen=True)
class Function:
    """A function of the physics library: its text and the names it uses."""

    name: str
    text: str
    uses: frozenset[str]


def link(scene: Scene) -> str:
    """Text of the standalone program of a scene; a pure function.

    Parameters
    ----------
    scene : Scene
        A validated scene.

    Returns
    -------
    str
        ASCII text of a Python file, formatted, with the `frames()` generator.

    Raises
    ------
    LinkError
        If the text uses a name that is not defined.
    """
    chunks = list(_fill(scene))
    body = "".join(text for _, text in chunks)
    outline = "".join(STUB if name == "scene" else text for name, text in chunks)
    functions, used = _resolve(_bare(outline))
    return _blank_lines(_imports(body.replace(PHYSICS, functions), used))


@lru_cache(RECENT)
def _resolve(outline: str) -> tuple[str, frozenset[str]]:
    """Functions that a program needs, and all names that it reads.

    The outline is the program without functions of the library, constants of its scene
    and numbers, so that scenes of one structure share it.
    """
    library = _library()
    used = _names_read(outline)
    needed = _closure(used, library)
    used = used.union(*(library[name].uses for name in needed))
    functions = "\n\n".join(library[name].text for name in library if name in needed)
    missing = unresolved(_imports(outline.replace(PHYSICS, functions), used))
    if missing:
        raise LinkError(f"the program uses undefined names: {', '.join(missing)}")
    return functions, used


def read_scene(program: str, source: str = "program.py") -> Scene:
    """The scene that a linked program implements, read from its constants."""
    constants: dict[str, Any] = {"schema": SCHEMA}
    wanted = {name.upper(): name for name in emit.SECTIONS}
    for node in ast.parse(program).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            name = node.targets[0].id
            if name in wanted:
                constants[wanted[name]] = _plain(node.value)
    return Scene.from_data(constants, source)


def _plain(node: ast.expr) -> Any:
    """Value of a literal in which mappings are written as dict(key=value)."""
    if (
        isinstance(node, ast.Call)
        and ast.unparse(node.func) == "dict"
        and not node.args
    ):
        return {str(pair.arg): _plain(pair.value) for pair in node.keywords}
    if isinstance(node, ast.List):
        return [_plain(item) for item in node.elts]
    return ast.literal_eval(node)


def unresolved(program: str) -> list[str]:
    """Global names that a program uses but never binds."""
    symbols = symtable.symtable(program, "program.py", "exec").get_symbols()
    bound = {s.get_name() for s in symbols if s.is_assigned() or s.is_imported()}
    return sorted(_names_read(program) - bound - set(dir(builtins)) - {"__name__"})


def features(scene: Scene) -> set[str]:
    """Which conditional regions a scene needs."""
    kinds = {thing.object_type for thing in scene.objects}
    models = emit.materials_of(scene)
    bodies = {
        thing.physics_properties.constitutive_model
        for thing in scene.objects
        if thing.object_type == "dynamic_body"
    }
    collider = bool(kinds & {"static_collider", "kinematic_collider"})
    motions = emit.motions_of(scene)
    still = "static_collider" in kinds or "conveyor" in motions
    found = {
        "body": bool(bodies - {"rigid"}),
        "emitter": "emitter" in kinds,
        "collider": collider or "rigid" in bodies,
        "solid": collider or bool(bodies),
        "moving": "kinematic_collider" in kinds,
        "polygon": any(thing.shape.type == "polygon" for thing in scene.objects),
        "rigid": "rigid" in bodies,
        "mesh": "elastic_fem" in bodies,
        "liquid": "liquid" in models,
        "crowd": bool(models & {"liquid", "viscoplastic", "viscoelastic"}),
        "still": still,
        "free": bool(motions - {"conveyor"}) or "rigid" in bodies,
        "lattice": bool(bodies),
        "probe": still or bool(bodies),
        "paste": bool(models & {"viscoplastic", "viscoelastic"}),
        "wet": "wet_sand" in models,
        "soak": {"wet_sand", "liquid"} <= models,
    }
    return {name for name, needed in found.items() if needed}


@cache
def _skeleton() -> list[str]:
    text = files("mpmworlds.sim").joinpath("skeleton.py").read_text("ascii")
    return text.splitlines(keepends=True)


@cache
def _library() -> dict[str, Function]:
    """Functions of the physics library, in an order in which each follows its uses."""
    found: dict[str, Function] = {}
    folder = files("mpmworlds.sim").joinpath("physics")
    names = sorted(entry.name for entry in folder.iterdir())
    for name in (name for name in names if name.endswith(".py")):
        text = folder.joinpath(name).read_text("ascii")
        lines = text.splitlines(keepends=True)
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef):
                first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
                source = "".join(lines[first - 1 : node.end_lineno])
                found[node.name] = Function(node.name, source, _names_read(source))
    ordered: dict[str, Function] = {}
    for name in sorted(found):
        _visit(name, found, ordered)
    return ordered


def _visit(name: str, found: dict[str, Function], ordered: dict[str, Function]) -> None:
    if name in ordered:
        return
    for used in sorted(found[name].uses & found.keys() - {name}):
        _visit(used, found, ordered)
    ordered[name] = found[name]


def _closure(names: frozenset[str], library: dict[str, Function]) -> set[str]:
    needed: set[str] = set()
    waiting = sorted(names & library.keys())
    while waiting:
        name = waiting.pop()
        if name not in needed:
            needed.add(name)
            waiting += sorted(library[name].uses & library.keys())
    return needed


def _bare(text: str) -> str:
    """A text without its numbers and their signs."""
    return SIGN.sub("", NUMBER.sub("0", text))


def _names_read(text: str) -> frozenset[str]:
    """Global names that a text reads, in whichever scope."""
    used: set[str] = set()
    scopes = [symtable.symtable(text, "text", "exec")]
    while scopes:
        scope = scopes.pop()
        scopes += scope.get_children()
        outermost = scope.get_type() == "module"
        for symbol in scope.get_symbols():
            if symbol.is_referenced() and (outermost or symbol.is_global()):
                used.add(symbol.get_name())
    return frozenset(used)


def _fill(scene: Scene) -> Iterator[tuple[str, str]]:
    """Texts of the skeleton and of its regions for a scene, each with its region."""
    for text, region in _parts(frozenset(features(scene))):
        yield "", text
        if region:
            yield region, PHYSICS if region == "physics" else REGIONS[region](scene)


@cache
def _parts(found: frozenset[str]) -> list[tuple[str, str]]:
    """Texts that stay in programs with some features, each with the region after it."""
    parts, lines = [], list[str]()
    keep = [True]  # for each region around the line, the innermost last
    for line in _skeleton():
        mark = MARK.match(line)
        name = mark.group(3) if mark else None
        if mark is None:
            if keep[-1]:
                lines.append(line)
        elif name is None:
            keep.pop()
        elif name.startswith("if "):
            keep.append(keep[-1] and name[3:] in found)
        else:
            if keep[-1]:
                parts.append(("".join(lines), name))
                lines = []
            keep.append(False)
    return [*parts, ("".join(lines), "")]


def _imports(text: str, used: frozenset[str]) -> str:
    """Drop our own imports, and the names of taichi.math that are not used."""
    lines = []
    for line in text.splitlines(keepends=True):
        if line.startswith(MATH):
            names = [n for n in line[len(MATH) :].strip().split(", ") if n in used]
            line = MATH + ", ".join(names) + "\n"
        if not line.startswith("from mpmworlds."):
            lines.append(line)
    return "".join(lines)


def _blank_lines(text: str) -> str:
    """Set blank lines as the formatter does: two around definitions, else up to one."""
    lines: list[str] = []
    in_definition = False
    for line in _single_blanks(text):
        starts = line.startswith(("def ", "@"))
        decorated = bool(lines) and lines[-1].startswith("@")
        if not line.startswith((" ", ")", "\n")):
            if (starts or in_definition) and lines and not decorated:
                while lines[-1] == "\n":
                    lines.pop()
                lines += ["\n", "\n"]
            in_definition = starts or (in_definition and decorated)
        lines.append(line)
    return "".join(lines)


def _single_blanks(text: str) -> list[str]:
    return re.sub(r"\n{3,}", "\n\n", text).splitlines(keepends=True)
