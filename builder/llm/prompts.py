"""What the language model is told: the rules of scenes, the examples, and the task."""

import inspect
import json
from collections.abc import Mapping
from functools import cache
from typing import Any, Final

from mpmworlds.builder.recipes.modify import EDITS
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.checks import HUE_STEP, MATERIAL_WORDS
from mpmworlds.sim.scene.objects import MATERIALS
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import SCHEMA, Scene, json_schema

Messages = list[dict[str, str]]
DROPPED: Final = ("title", "tag")  # of the JSON Schema: they say nothing to a model

RULES: Final = f"""\
You design scenes for a 2D Material Point Method simulator. A scene is a YAML file of \
schema {SCHEMA}: objects in a closed square of 1 m x 1 m, x to the right, y up, units \
metres, seconds, kg per square metre, Pa. Rules that every scene must obey:
- Keep the sections `simulation` and `output` of an example, but choose another seed.
- Keys are those of the JSON Schema only; every number is finite.
- Objects have the names object_0, object_1, ... A name never gives away a material \
({", ".join(MATERIAL_WORDS)}).
- Bodies and emitters stay clear of the walls, which are `thickness_cells` of the grid \
thick; colliders stay within the square, also on their way.
- No body overlaps another body, a collider or an emitter at the start.
- At least one dynamic_body or emitter. Materials: {", ".join(MATERIALS)}.
- The center of a rigid body is its center of mass.
- time_step_dt suits the stiffest and fastest object: take stiffness, density and \
viscosity of the same order as in the examples.
- An emitter's rate is at most what its nozzle lets through: its extent across the \
velocity times the speed, over the area of a particle.
- Colours come from this palette only, with hues at least {HUE_STEP:.0f} degrees \
apart: {", ".join(PALETTE.values())}.
- Something must still move 2.5 s of video after the start, and the objects should \
meet and act on each other in a way that depends on their materials."""

ANSWER: Final = """\
Answer with one fenced block that starts with ```yaml and holds the complete scene. \
Write no other YAML block."""

ANSWER_WITH_PROGRAM: Final = """\
Answer with two fenced blocks and no others. The first starts with ```yaml and holds \
the complete scene. The second starts with ```python and holds a standalone program \
that implements it, as in the examples: it imports only math, sys, numpy, taichi and \
cv2; frames() is a generator of uint8 arrays of shape (resolution, resolution, 3), \
RGB, objects in their flat colours on black, of which the first shows the scene at the \
start."""


def parent_messages(examples: Mapping[str, Scene], *, programs: bool) -> Messages:
    """Messages that ask for a new scene.

    Parameters
    ----------
    examples
        Seed scenes to show, by name.
    programs
        Show their programs, and ask for one.

    Returns
    -------
    list of dict
        Chat messages, `role` and `content`.
    """
    shown = [
        _example(f"Example {number}", scene, programs)
        for number, scene in enumerate(examples.values(), 1)
    ]
    task = (
        "Design a new scene. It may combine objects, materials and motions of the "
        "examples, in another layout, and should bring an interaction that none of "
        "them shows. Take 2 to 5 objects."
    )
    return _messages(shown, task, programs)


def child_messages(parent: Scene, edit: str, *, programs: bool) -> Messages:
    """Messages that ask for an edited scene.

    Parameters
    ----------
    parent
        The scene to edit.
    edit
        Name of a structured edit, a key of `EDITS`.
    programs
        Show the scene's program, and ask for one of the edited scene.

    Returns
    -------
    list of dict
        Chat messages, `role` and `content`.
    """
    meaning = inspect.getdoc(EDITS[edit]) or edit
    task = (
        f"Apply the edit `{edit}` to the scene: {meaning} Choose what and how so that "
        "the physics changes visibly. Leave everything else as it is, but for what the "
        "rules then demand. If the scene holds nothing that the edit applies to, make "
        "the nearest change that does."
    )
    return _messages([_example("The scene", parent, programs)], task, programs)


def _messages(shown: list[str], task: str, programs: bool) -> Messages:
    schema = f"JSON Schema of a scene:\n```json\n{_schema()}\n```"
    answer = ANSWER_WITH_PROGRAM if programs else ANSWER
    return [
        {"role": "system", "content": f"{RULES}\n\n{schema}"},
        {"role": "user", "content": "\n\n".join([*shown, task, answer])},
    ]


def _example(title: str, scene: Scene, programs: bool) -> str:
    text = f"{title}:\n```yaml\n{scene.to_yaml()}```"
    if programs:
        text += f"\nIts program:\n```python\n{link(scene)}```"
    return text


@cache
def _schema() -> str:
    return json.dumps(_bare(json_schema()), separators=(",", ":"))


def _bare(node: Any) -> Any:
    """The schema without what says nothing to a model."""
    if isinstance(node, list):
        return [_bare(item) for item in node]
    if not isinstance(node, dict):
        return node
    return {
        key: _bare(value)
        for key, value in node.items()
        if key not in DROPPED or isinstance(value, dict)  # a property of that name
    }
