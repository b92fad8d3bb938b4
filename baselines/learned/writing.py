"""What models that write programs share: the question, and the reading of a reply."""

import ast
import hashlib
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from mpmworlds.baselines.protocol import Failure, ProgramText, SceneText, Task
from mpmworlds.loaders.clips import Clip, Stills, sampled
from mpmworlds.loaders.prompts import PROMPT_VERSION, TASKS, Prompt, make_prompt
from mpmworlds.loaders.regimes import regime_named
from mpmworlds.loaders.scaffold import SCAFFOLD_VERSION

EXTRACTOR_VERSION: Final = "mpmworlds-extractor/1"
"""Of what `read_reply` takes for the answer; other rules are another version."""
VERSIONS: Final[Mapping[str, str]] = {
    "prompt": PROMPT_VERSION,
    "scaffold": SCAFFOLD_VERSION,
    "extractor": EXTRACTOR_VERSION,
}
ENTRY: Final = re.compile(r"^def frames\(", re.MULTILINE)

Written = ProgramText | SceneText | Failure


def check_question(pictures: int, wanted: str) -> None:
    """Refuse what cannot be asked.

    Raises
    ------
    ValueError
        If there is no such task, or one picture alone, which shows no motion.
    """
    if wanted not in TASKS:
        raise ValueError(f"task = {wanted!r}, must be one of {', '.join(TASKS)}")
    if pictures < 0 or pictures == 1:
        raise ValueError(
            f"pictures = {pictures}, must be at least 2, or 0 for a model that sees "
            "nothing"
        )


def question(task: Task, pictures: int, wanted: str, *, schema: bool) -> Prompt:
    """What a model is asked for a task.

    Parameters
    ----------
    task
        Of the evaluation.
    pictures
        Number of frames that are shown, at least 2, or 0.
    wanted
        ``program`` or ``scene``.
    schema
        Whether the JSON Schema is told with the latter.
    """
    clip = Clip(task.prefix, task.framerate)
    stills = sampled(clip, pictures) if pictures else Stills(task.prefix[:0], ())
    regime = regime_named(task.regime)
    return make_prompt(stills, regime, task.side_info, task.form, wanted, schema=schema)


def seed_of(seed: int, *names: str) -> int:
    """Seed of what has these names, whatever else is drawn, in [0, 2^31)."""
    text = "\0".join([str(seed), *names])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big") >> 1


def read_choice(choice: Any, wanted: str) -> Written:
    """Read a choice of a chat completion, plain data; see `read_reply`."""
    from mpmworlds.builder.llm.replies import Rejection, text_of

    said = text_of(choice)
    if isinstance(said, Rejection):
        return Failure(said.reason, said.detail)
    return read_reply(said, wanted)


def read_reply(text: str, wanted: str) -> Written:
    """The program or scene in a reply that came to its end.

    Of several blocks of code the last one counts that has the generator ``frames``
    (a scene: its schema), else the last one: models that try things end with what they
    mean. A reply without blocks counts as a whole if it is one.

    Parameters
    ----------
    text
        Markdown, or the answer alone.
    wanted
        ``program`` or ``scene``.

    Returns
    -------
    ProgramText, SceneText or Failure
        The failure is ``refused``, ``truncated`` in the midst of a block,
        ``no_program`` or ``no_scene``.
    """
    from mpmworlds.builder.llm.replies import (
        DECLINED,
        PROGRAM,
        PYTHON,
        SCENE,
        THOUGHT,
        YAML,
        UnclosedError,
        fenced_blocks,
    )

    text = THOUGHT.sub("", text)
    languages: Sequence[str] = PYTHON
    looks, entry = PROGRAM, ENTRY
    if wanted == "scene":
        languages, looks, entry = YAML, SCENE, SCENE
    try:
        blocks = fenced_blocks(text)
    except UnclosedError as error:
        return Failure("truncated", str(error))
    found = [
        block.text
        for block in blocks
        if block.language in languages
        or (not block.language and looks.search(block.text))
    ]
    if not blocks and entry.search(text) and _is_whole(text, wanted):
        found = [text]
    if not found:
        return _nothing(text, len(blocks), wanted, bool(DECLINED.search(text)))
    best = _last(found, entry)
    return SceneText(best) if wanted == "scene" else ProgramText(best)


def _is_whole(text: str, wanted: str) -> bool:
    """Whether a text without blocks is an answer from its first word to its last."""
    from mpmworlds.builder.llm.replies import SCENE

    if wanted == "scene":
        return bool(SCENE.match(text.lstrip()))
    try:
        ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True


def _last(found: Sequence[str], entry: re.Pattern[str]) -> str:
    whole = [text for text in found if entry.search(text)]
    return (whole or found)[-1]


def _nothing(text: str, blocks: int, wanted: str, declined: bool) -> Failure:
    if not blocks and declined:
        return Failure("refused", text.strip().splitlines()[0])
    return Failure(f"no_{wanted}", f"none of {blocks} blocks of code is a {wanted}")
