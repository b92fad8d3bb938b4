"""The linker: from a scene to the text of its standalone program.

It follows the outline, pastes what the features of the scene have for each place of it,
and writes before each part the functions that the part is the first to need. The kinds
that occur in the scene decide on the structure of the text; the numbers of the scene
stand where they are used.
"""

import builtins

from mpmworlds.sim.program.linking.cast import Cast
from mpmworlds.sim.program.linking.layout import spaced
from mpmworlds.sim.program.linking.places import places_of
from mpmworlds.sim.program.linking.sections import SECTIONS, header, own_functions
from mpmworlds.sim.program.linking.source import names_bound, names_read
from mpmworlds.sim.program.linking.writer import Writer
from mpmworlds.sim.scene.scene import Scene


class LinkError(ValueError):
    """A program that would not run: it uses a name that nothing defines."""


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
    cast = Cast(scene)
    writer = Writer(places_of(cast), own_functions(cast))
    for section in SECTIONS:
        section(cast, writer)
    body = writer.text()
    if cast.is_alone:
        body = body.replace("mass[p]", "MASS")
    text = header(cast, body) + body
    missing = unresolved(text)
    if missing:
        raise LinkError(f"the program uses undefined names: {', '.join(missing)}")
    return spaced(text)


def unresolved(program: str) -> list[str]:
    """Global names that a program uses but never binds."""
    known = names_bound(program) | {*dir(builtins), "__name__"}
    return sorted(names_read(program) - known)
