"""The text that a video model is told: a scene in as few tokens as it takes.

The text encoder reads 512 tokens and a pipeline cuts the rest off without a word. The
YAML of a scene is longer in four of five rows, and what is cut are its last objects.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from mpmworlds.files.machine_yaml import read_machine_yaml
from mpmworlds.loaders.prompts import CONTINUE
from mpmworlds.loaders.regimes import COLOR_WORDS

TEXT_VERSION: Final = "mpmworlds-vdm-text/1"
MOST_TOKENS: Final = 512  # of the UMT5 encoder in Wan and LongCat
DIGITS: Final = 3  # of a number that are told
# Of the solver and the file, not of the world that is seen; a name is a number.
UNTOLD: Final = frozenset(
    {"schema", "simulation", "output", "thickness_cells", "skin_cells", "name"}
)


def text_for(side_info: str) -> str:
    """The text for a video model, on one line.

    Parameters
    ----------
    side_info
        What a regime tells: YAML of a scene or of what is left of one, or plain words,
        or nothing.

    Returns
    -------
    str
        The YAML without its layout, or the words as they are, or
        `mpmworlds.loaders.prompts.CONTINUE`.
    """
    if not side_info.strip():
        return CONTINUE
    data = _mapping(side_info)
    if data is None:
        return " ".join(side_info.split())
    told = {key: value for key, value in data.items() if key != "objects"}
    parts = [told, *data.get("objects", ())]
    return "; ".join(filter(None, (" ".join(_words(part)) for part in parts)))


def _mapping(side_info: str) -> Mapping[str, Any] | None:
    """Data of a text whose first line is a key; None of plain words."""
    if not side_info.partition("\n")[0].partition(":")[0].isidentifier():
        return None
    data = read_machine_yaml(side_info)
    return data if isinstance(data, dict) else None


def _words(part: Mapping[str, Any]) -> Iterator[str]:
    """Keys and values of what is told; a mapping gives its own, a text stands alone.

    A word that tells what a thing is needs no key, and a number that is zero is not
    told: both are clear from the rest, and each digit is a token.
    """
    for key, value in part.items():
        if key in UNTOLD:
            continue
        if isinstance(value, dict):
            yield from _words(value)
        elif isinstance(value, str):
            yield COLOR_WORDS.get(value, value.replace("_", " "))
        elif numbers := _numbers(value):
            yield f"{key.replace('_', ' ')} {numbers}"


def _numbers(value: Any) -> str:
    """A number or nested lists of them; empty if all are zero."""
    if isinstance(value, list):
        inner = [_numbers(one) or "0" for one in value]
        return "" if set(inner) <= {"0"} else " ".join(inner)
    if not value:
        return ""
    if isinstance(value, float):
        # Three digits: a place is then wrong by an eighth of a pixel of 256 at most.
        value = round(value, DIGITS - 1 - math.floor(math.log10(abs(value))))
    short = np.format_float_positional(value, trim="-")
    return short.replace("0.", ".", 1) if abs(value) < 1 else short
