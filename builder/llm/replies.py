"""From the text of a model to a valid scene, or the reason why there is none."""

import re
from dataclasses import dataclass
from typing import Any, Final, Literal

from markdown_it import MarkdownIt

from mpmworlds.sim.scene.palette import is_exact, nearest
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.sim.scene.text import parse_yaml

Reason = Literal[
    "malformed",  # a choice without a message
    "refused",  # the model or the server's filter declines
    "truncated",  # it was cut off
    "empty",  # it says nothing
    "no_yaml",  # no block that could be a scene
    "several_yaml",  # more than one
    "bad_yaml",  # the block is not YAML
    "invalid_scene",  # it is YAML, but breaks a rule of scenes
]
YAML: Final = ("yaml", "yml")
PYTHON: Final = ("python", "py", "python3")
THOUGHT: Final = re.compile(r"\A\s*<think>.*?</think>", re.DOTALL)
SCENE: Final = re.compile(r"^schema:", re.MULTILINE)
PROGRAM: Final = re.compile(r"^(def|import|from) ", re.MULTILINE)
DECLINED: Final = re.compile(
    r"\b(I'm|I am) (sorry|unable|not able)|\bI (can't|cannot|can not|won't)\b",
    re.IGNORECASE,
)
HEX: Final = re.compile(r"#[0-9A-Fa-f]{6}")


@dataclass(frozen=True)
class Rejection:
    """Why a reply gives no scene.

    Attributes
    ----------
    reason
        One of `Reason`, to be counted.
    detail
        What exactly was wrong.
    """

    reason: Reason
    detail: str


@dataclass(frozen=True)
class Suggestion:
    """What a reply gives.

    Attributes
    ----------
    scene
        A valid scene in palette colours.
    programs
        Programs beside it; there should be at most one.
    """

    scene: Scene
    programs: tuple[str, ...]


@dataclass(frozen=True)
class Block:
    """A fenced block: the language that its fence names, and its text."""

    language: str
    text: str


class UnclosedError(ValueError):
    """A fenced block does not end."""


def read_choice(choice: Any, source: str) -> Suggestion | Rejection:
    """Read one choice of a chat completion.

    Parameters
    ----------
    choice
        Plain data, with `message` and `finish_reason`.
    source
        Name of the reply, for messages.

    Returns
    -------
    Suggestion or Rejection
        The scene, or the first reason against it.
    """
    said = text_of(choice)
    return said if isinstance(said, Rejection) else _read_text(said, source)


def text_of(choice: Any) -> str | Rejection:
    """What a choice says, without what was thought before, or why that is nothing."""
    message = choice.get("message") if isinstance(choice, dict) else None
    if not isinstance(message, dict):
        return Rejection("malformed", "the choice holds no message")
    text, finish = message.get("content"), choice.get("finish_reason")
    if message.get("refusal"):
        return Rejection("refused", str(message["refusal"]))
    if finish == "content_filter":
        return Rejection("refused", "the server's content filter stopped it")
    if finish == "length":
        return Rejection("truncated", "the model reached its limit of tokens")
    if not isinstance(text, str) or not text.strip():
        return Rejection("empty", "the reply holds no text")
    return THOUGHT.sub("", text)


def _read_text(text: str, source: str) -> Suggestion | Rejection:
    try:
        blocks = fenced_blocks(text)
    except UnclosedError as error:
        return Rejection("truncated", str(error))
    scenes = [b.text for b in blocks if _is(b, YAML, SCENE)]
    if not blocks and (SCENE.match(text.lstrip()) or text.lstrip().startswith("{")):
        scenes = [text]  # the whole reply is the file, or the JSON of one
    if not scenes:
        if not blocks and DECLINED.search(text):
            return Rejection("refused", text.strip().splitlines()[0])
        return Rejection("no_yaml", f"none of {len(blocks)} fenced blocks is YAML")
    if len(scenes) > 1:
        return Rejection("several_yaml", f"{len(scenes)} YAML blocks, must be one")
    try:
        data = parse_yaml(scenes[0], source)
    except SceneError as error:
        return Rejection("bad_yaml", str(error))
    move_to_palette(data)
    try:
        scene = Scene.from_data(data, source)
    except SceneError as error:
        return Rejection("invalid_scene", str(error))
    return Suggestion(scene, tuple(b.text for b in blocks if _is(b, PYTHON, PROGRAM)))


def _is(block: Block, languages: tuple[str, ...], content: re.Pattern[str]) -> bool:
    """Whether a block names one of some languages, or names none but looks like it."""
    if block.language:
        return block.language in languages
    other = PROGRAM if content is SCENE else SCENE
    return bool(content.search(block.text)) and not other.search(block.text)


def fenced_blocks(text: str) -> list[Block]:
    """Fenced code blocks of Markdown text, in order.

    Parameters
    ----------
    text
        Markdown.

    Returns
    -------
    list of Block
        Without their fences.

    Raises
    ------
    UnclosedError
        If the last one does not end.
    """
    lines = re.sub(r"\r\n?", "\n", text).split("\n")  # as Markdown counts them
    blocks: list[Block] = []
    for token in MarkdownIt().parse(text):
        if token.type != "fence" or token.map is None:
            continue
        first, end = token.map
        if end - first < 2 or not lines[end - 1].strip(" >").startswith(token.markup):
            raise UnclosedError(f"fenced block {len(blocks) + 1} does not end")
        language = token.info.split(maxsplit=1)[0].lower() if token.info else ""
        blocks.append(Block(language, token.content))
    return blocks


def move_to_palette(data: Any) -> None:
    """Replace colours that the codec does not keep by the nearest ones, in place.

    Parameters
    ----------
    data
        Plain data of a scene, not validated yet; what is no colour stays as it is.
    """
    objects = data.get("objects") if isinstance(data, dict) else None
    for thing in objects if isinstance(objects, list) else []:
        looks = thing.get("visualization") if isinstance(thing, dict) else None
        if not isinstance(looks, dict):
            continue
        color = looks.get("color")
        if isinstance(color, str) and HEX.fullmatch(color) and not is_exact(color):
            looks["color"] = nearest(color)
