"""Scenes that occur in two splits: to the letter, or the same when told more roughly.

Scenes are compared as text here, which takes a tenth of a millisecond each, so that all
of a corpus can be.
"""

import hashlib
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Final

from mpmworlds.splits.audit_records import Finding, Record

DIGITS: Final = 2  # significant digits that are compared
_WORD: Final = re.compile(  # a colour, the seed, or a number
    r"'#[0-9A-Fa-f]{6}'|seed: \d+|(?<=[ \[])-?\d[^\s,\]}]*", re.ASCII
)
_OBJECT: Final = re.compile(r"^- name: .*\n", re.MULTILINE)


def duplicate_findings(records: Sequence[Record]) -> Iterator[Finding]:
    """Find samples of two splits that are the same.

    Parameters
    ----------
    records
        The samples of a corpus.

    Yields
    ------
    Finding
        A scene that is not the one of its checksum; a scene text or a program that is
        in two splits; scenes of two splits with the same `rough_text`.
    """
    for record in records:
        found = hashlib.sha256(record.scene.encode()).hexdigest()
        if found != record.scene_sha256:
            detail = f"is {found[:12]}..., its row says {record.scene_sha256[:12]}..."
            yield Finding("scene_sha256", (record.id,), detail)
    told: set[tuple[str, ...]] = set()
    for rule, key in (
        ("same scene", lambda record: record.scene_sha256),
        ("same program", lambda record: record.program_sha256),
        ("same scene after rounding", lambda record: rough_text(record.scene)),
    ):
        for finding in _across_splits(records, rule, key):
            if finding.ids not in told:
                yield finding
            told.add(finding.ids)


def rough_text(scene: str) -> str:
    """Return what a scene says when it is told more roughly.

    Parameters
    ----------
    scene
        Canonical text of a scene, as `Scene.to_yaml` writes it.

    Returns
    -------
    str
        The text without names, colours and seed, with `DIGITS` significant digits, and
        its objects in order. The same for scenes that differ in nothing else. Two
        numbers on both sides of a rounding limit stay different, however near; such
        scenes are found by their distance.
    """
    text = _WORD.sub(lambda match: _told(match[0]), scene)
    head, *objects = _OBJECT.split(text)
    if objects:
        last, _, tail = objects[-1].partition("\noutput:")
        objects[-1], head = last, head + tail
    parts = [head, *sorted(" ".join(thing.split()) for thing in objects)]
    return "\n".join(parts)


@lru_cache(1 << 16)
def _told(word: str) -> str:
    """What remains of a word: of a number its leading digits, of others nothing."""
    if word[0] in "'s":
        return ""
    try:
        return f"{float(word) + 0.0:.{DIGITS}g}"  # + 0.0 takes the sign off -0.0
    except ValueError:  # a text that begins with a digit
        return word


def _across_splits(
    records: Iterable[Record], rule: str, key: Callable[[Record], str]
) -> Iterator[Finding]:
    """Groups of samples with one key that are in more than one split."""
    groups: dict[str, list[Record]] = defaultdict(list)
    for record in records:
        groups[key(record)].append(record)
    for group in groups.values():
        splits: dict[str, list[str]] = defaultdict(list)
        for record in group:
            splits[record.split].append(record.id)
        if len(splits) > 1:
            counts = [f"{len(splits[split])} in {split}" for split in sorted(splits)]
            ids = tuple(min(splits[split]) for split in sorted(splits))
            yield Finding(rule, ids, ", ".join(counts), 0.0)
