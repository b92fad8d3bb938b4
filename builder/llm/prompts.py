"""What the language model is told: the rules of scenes, the examples, and the task."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import yaml

from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.scene import Scene

Messages = list[dict[str, str]]


@dataclass(frozen=True)
class Wording:
    """One version of all texts; requests of a version never change.

    Attributes
    ----------
    rules, schema
        What every scene must obey, and all keys that it may have.
    answer, answer_with_program
        What to answer with.
    parent, child
        What to do; that of a child has places for an edit and its meaning.
    edits
        Meaning of each structured edit that may be asked for.
    """

    rules: str
    schema: str
    answer: str
    answer_with_program: str
    parent: str
    child: str
    edits: dict[str, str]


@cache
def wording(version: str) -> Wording:
    """The texts of a version; raises `ValueError` if there is no such version."""
    folder = files("mpmworlds.builder.llm").joinpath("wording")
    file = folder.joinpath(f"{version}.yaml")
    if not file.is_file():
        known = sorted(f.name.removesuffix(".yaml") for f in folder.iterdir())
        raise ValueError(f"wording = {version!r}, must be one of {', '.join(known)}")
    return Wording(**yaml.safe_load(file.read_text("utf-8")))


def parent_messages(
    examples: Mapping[str, Scene], *, programs: bool, version: str
) -> Messages:
    """Messages that ask for a new scene.

    Parameters
    ----------
    examples
        Seed scenes to show, by name.
    programs
        Show their programs, and ask for one.
    version
        Of the wording.

    Returns
    -------
    list of dict
        Chat messages, `role` and `content`.
    """
    shown = [
        _example(f"Example {number}", scene, programs)
        for number, scene in enumerate(examples.values(), 1)
    ]
    return _messages(shown, wording(version).parent, programs, version)


def child_messages(
    parent: Scene, edit: str, *, programs: bool, version: str
) -> Messages:
    """Messages that ask for an edited scene.

    Parameters
    ----------
    parent
        The scene to edit.
    edit
        Name of a structured edit, a key of `Wording.edits`.
    programs
        Show the scene's program, and ask for one of the edited scene.
    version
        Of the wording.

    Returns
    -------
    list of dict
        Chat messages, `role` and `content`.
    """
    words = wording(version)
    task = words.child.format(edit=edit, meaning=words.edits[edit])
    return _messages([_example("The scene", parent, programs)], task, programs, version)


def _messages(shown: list[str], task: str, programs: bool, version: str) -> Messages:
    words = wording(version)
    answer = words.answer_with_program if programs else words.answer
    schema = f"Keys of a scene, with limits, defaults and meanings:\n{words.schema}"
    return [
        {"role": "system", "content": f"{words.rules}\n\n{schema}"},
        {"role": "user", "content": "\n\n".join([*shown, task, answer])},
    ]


def _example(title: str, scene: Scene, programs: bool) -> str:
    text = f"{title}:\n```yaml\n{scene.to_yaml()}```"
    if programs:
        text += f"\nIts program:\n```python\n{link(scene)}```"
    return text
