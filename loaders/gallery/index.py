"""The index of a gallery: what the page must know of every sample at once."""

import re
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any, Final

from mpmworlds.loaders.gallery.site import script

_WORD: Final = re.compile(r"[a-z]\w+", re.ASCII)
_DIGITS: Final = 3  # of a motion


def index_of(
    rows: Sequence[Mapping[str, Any]], title: str, *, exact: bool
) -> dict[str, bytes]:
    """Scripts of the index.

    Parameters
    ----------
    rows
        Samples in the order of the page; without their videos and programs.
    title
        Name of the gallery.
    exact
        Whether it has exact videos.

    Returns
    -------
    dict
        Name -> content. `data.js` is for the list and its filters; `words.js` has the
        words of all scenes, and is loaded once one searches.
    """
    kinds = _values([row["kind"]] for row in rows)
    splits = _values([row["split"]] for row in rows)
    materials = _values(row["materials"] for row in rows)
    types = _values(row["object_types"] for row in rows)
    told = [
        [
            row["id"],
            row["parent_id"],
            kinds[row["kind"]],
            splits[row["split"]],
            [materials[name] for name in row["materials"]],
            [types[name] for name in row["object_types"]],
            row["num_objects"],
            _rounded(row["motion"]),
        ]
        for row in rows
    ]
    index = {
        "title": title,
        "exact": exact,
        "kinds": list(kinds),
        "splits": list(splits),
        "materials": list(materials),
        "types": list(types),
        "rows": told,
    }
    words = [
        sorted(set(_WORD.findall(f"{row['scene']} {row['edit']}".lower())))
        for row in rows
    ]
    numbers = _values(words)
    searched = {
        "words": list(numbers),
        "rows": [[numbers[word] for word in some] for some in words],
    }
    return {
        "data.js": script("onIndex", index),
        "words.js": script("onWords", searched),
    }


def _values(some: Any) -> dict[str, int]:
    """Values that occur -> their numbers, in the order of the alphabet."""
    return {value: n for n, value in enumerate(sorted(set(chain(*some))))}


def _rounded(motion: float | None) -> float | None:
    return None if motion is None else round(motion, _DIGITS)
