"""What a regime tells, as a vector for each slot: hashed names with their numbers.

Every leaf of a scene counts, whatever its name: `path=text` is a feature, and `path`
with a number one that has its value, at a place and with a sign that follow from a hash
of the name [Weinberger et al. 2009]. A regime that hides something has fewer of them,
and a new field of the schema needs nothing here.
"""

import hashlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.filling import told_scene
from mpmworlds.baselines.small.slots import CLASSES, Slots
from mpmworlds.loaders.regimes import COLOR_WORDS, color_said

FEATURES: Final = 64
Fields = npt.NDArray[np.float32]
_SENTENCE: Final = re.compile(r"(?<=\.) ")
_WORD: Final = re.compile(r"[a-z]+")


def fields_of(side_info: str, slots: Slots) -> Fields:
    """Features of what is told.

    Parameters
    ----------
    side_info
        What a regime tells: YAML of a scene with gaps, a caption, or nothing.
    slots
        The colours of the prefix, which say whose features are whose.

    Returns
    -------
    ndarray
        float32 (CLASSES, FEATURES): of the whole scene and of what no slot shows, then
        of what each slot shows.
    """
    found = np.zeros((CLASSES, FEATURES), np.float32)
    scene = told_scene(side_info)
    told = _of_caption(side_info) if scene is None else _of_scene(scene)
    numbers = {color: number for number, color in enumerate(slots.colors, 1)}
    for color, name, value in told:
        place, sign = _place(name)
        found[numbers.get(color, 0), place] += sign * value
    return found


def _of_scene(scene: Mapping[str, Any]) -> Iterator[tuple[str, str, float]]:
    """Colour, name and value of each leaf; the colour is empty if it has none."""
    for key, part in scene.items():
        things = part if key == "objects" else [part]
        for thing in things:
            looks = thing.get("visualization", {}) if isinstance(thing, dict) else {}
            for name, value in _leaves(key, thing):
                yield looks.get("color", ""), name, value


def _leaves(name: str, part: Any) -> Iterator[tuple[str, float]]:
    if isinstance(part, Mapping):
        for key, value in part.items():
            yield from _leaves(f"{name}.{key}", value)
    elif isinstance(part, Sequence) and not isinstance(part, str):
        for number, value in enumerate(part):
            yield from _leaves(f"{name}.{number}", value)
    elif isinstance(part, bool | str):
        yield f"{name}={part}", 1.0
    elif part is not None:  # moduli and rates span orders of magnitude
        yield name, math.copysign(math.log1p(abs(part)), part)


def _of_caption(text: str) -> Iterator[tuple[str, str, float]]:
    """Words of each sentence, with the colour that it begins with, if any."""
    for sentence in _SENTENCE.split(text):
        said = sentence.partition(": ")[2] or sentence
        color = color_said(said)
        for word in _WORD.findall(said[len(COLOR_WORDS.get(color, "")) :].lower()):
            yield color, f"word {word}", 1.0


@cache
def _place(name: str) -> tuple[int, int]:
    """Where a feature counts, and with what sign."""
    digest = hashlib.sha256(name.encode()).digest()
    return int.from_bytes(digest[:4]) % FEATURES, 1 if digest[4] & 1 else -1
