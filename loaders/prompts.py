"""Prompts: what a model that writes programs or scenes is asked for a sample.

A prompt is made of pictures of the prefix, the text of a regime, and numbers of the
video that every scene of a corpus shares; it never sees a row or a scene, so nothing
else of them can be in it.
"""

import base64
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, NamedTuple

import cv2
import numpy as np

from mpmworlds.loaders.clips import Stills
from mpmworlds.loaders.load import Example
from mpmworlds.loaders.regimes import Regime
from mpmworlds.loaders.scaffold import RULES, SKELETON, read_wording
from mpmworlds.metrics.reduction import PREFIX_SECONDS, Frames
from mpmworlds.sim.scene.scene import json_schema

_TEXTS: Final = read_wording("prompts")
PROMPT_VERSION: Final[str] = _TEXTS["version"]
TASKS: Final = ("program", "scene")
PICTURES: Final = 8  # of a prefix, by default
CONTINUE: Final[str] = _TEXTS["continue"]
"""What a model that continues videos is told where the regime tells nothing."""
_FOR_EDITORS: Final = ("title", "tag", "kind", "$schema")  # keys of the JSON Schema


class Picture(NamedTuple):
    """A frame that is shown."""

    frame: Frames
    """uint8 (N, N, 3), RGB."""
    seconds: float
    """Its time in the video. [s]"""


class VideoForm(NamedTuple):
    """The form of the whole video, as a program yields it."""

    frames: int
    """Number of frames."""
    framerate: int
    """Frames per second. [1/s]"""
    pixels: int
    """Pixels per side."""

    @classmethod
    def of_row(cls, row: Mapping[str, Any]) -> "VideoForm":
        """The form of the video of a row of a release."""
        return cls(row["num_frames"], row["framerate"], row["resolution"])


Part = str | Picture
Message = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Prompt:
    """A system text, and what the user says, in texts and pictures."""

    system: str
    user: tuple[Part, ...]

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """The pictures, in their order."""
        return tuple(part for part in self.user if isinstance(part, Picture))

    def messages(self, show: Callable[[Picture], Message]) -> list[Message]:
        """As messages of a chat; a text ends its line, as templates only join parts.

        Parameters
        ----------
        show
            What stands for a picture: `as_url` for servers, `as_place` where the
            pictures are handed over beside the messages.
        """
        content = [
            {"type": "text", "text": f"{part}\n"}
            if isinstance(part, str)
            else show(part)
            for part in self.user
        ]
        return [
            {"role": "system", "content": [{"type": "text", "text": self.system}]},
            {"role": "user", "content": content},
        ]


def make_prompt(
    stills: Stills,
    regime: Regime,
    side_info: str,
    form: VideoForm,
    task: str = "program",
    *,
    schema: bool = False,
) -> Prompt:
    """Ask for a program, or for a scene.

    Parameters
    ----------
    stills
        Frames of the prefix; none for models that see nothing.
    regime, side_info
        The regime, and what it tells of the scene.
    form
        Of the video.
    task
        ``program`` or ``scene``.
    schema
        Whether the JSON Schema is told with the task ``scene``; about 30 kB.

    Raises
    ------
    ValueError
        If there is no such task.
    """
    if task not in TASKS:
        raise ValueError(f"task = {task!r}, must be one of {', '.join(TASKS)}")
    video = _TEXTS["video" if len(stills.frames) else "video_untold"].format(
        **form._asdict(), seconds=PREFIX_SECONDS, pictures=len(stills.frames)
    )
    shown: list[Part] = [video.strip()]
    for frame, seconds in zip(*stills, strict=True):
        shown += [_TEXTS["time"].format(seconds=seconds), Picture(frame, seconds)]
    told = _TEXTS["untold"]
    if not regime.blind:
        told = f"{_TEXTS['told'].format(meaning=regime.meaning)}\n\n{side_info.strip()}"
    return Prompt(_system(task, schema), (*shown, told, _TEXTS["ask"][task]))


def prompt_for(
    example: Example,
    task: str = "program",
    pictures: int = PICTURES,
    *,
    schema: bool = False,
) -> Prompt:
    """The prompt of an example, under its regime; see `make_prompt`."""
    return make_prompt(
        example.sampled_prefix(pictures),
        example.regime,
        example.side_info,
        VideoForm.of_row(example.row),
        task,
        schema=schema,
    )


def answer_of(row: Mapping[str, Any], task: str) -> str:
    """The answer that a model is to give for a row of a release: one fenced block."""
    return f"```{_TEXTS['fence'][task]}\n{row[task].strip()}\n```"


def as_url(picture: Picture) -> Message:
    """A picture in a message to a server that speaks as OpenAI's do."""
    url = f"data:image/png;base64,{base64.b64encode(png_of(picture.frame)).decode()}"
    return {"type": "image_url", "image_url": {"url": url}}


def as_place(picture: Picture) -> Message:
    """Where a picture belongs that is handed over beside the messages."""
    return {"type": "image"}


def png_of(frame: Frames) -> bytes:
    """A frame (N, N, 3), RGB, as a PNG file."""
    bgr = np.ascontiguousarray(frame[..., ::-1])
    return cv2.imencode(".png", bgr)[1].tobytes()


@cache
def _system(task: str, schema: bool) -> str:
    """What is the same for every sample."""
    texts = [_TEXTS["system"][task]]
    if task == "program":
        texts += [RULES, f"{_TEXTS['start']}\n```python\n{SKELETON}```\n"]
    elif schema:
        texts += [f"{_TEXTS['schema']}\n```json\n{_compact_schema()}\n```\n"]
    return "\n".join([*texts, _TEXTS["reply"][task]])


def _compact_schema() -> str:
    """The JSON Schema of a scene on one line, without what serves editors alone."""
    return json.dumps(_stripped(json_schema()), separators=(",", ":"))


def _stripped(schema: Any) -> Any:
    if isinstance(schema, dict):
        return {
            key: _stripped(value)
            for key, value in schema.items()
            if not (key in _FOR_EDITORS and isinstance(value, str))
        }
    if isinstance(schema, list):
        return [_stripped(value) for value in schema]
    return schema
