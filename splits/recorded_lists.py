"""Recorded split lists: one sorted text file per list, and their checksums.

The lists follow from the ids and the parameters, so they need not be stored; they are
stored so that a change of the division shows as a change of a file.
"""

import hashlib
import itertools
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.checksums import CHECKSUMS, ChecksumError, read_checksums
from mpmworlds.splits.assign import SPLITS, SplitParams
from mpmworlds.splits.lists import ListParams, compute_lists

RECORDED = files("mpmworlds.splits") / "recorded"  # lists of each profile
_NAME = re.compile(r"[a-z0-9][a-z0-9_]*", re.ASCII)


class SplitListError(ValueError):
    """Recorded lists that cannot be what was written."""


def write_lists(directory: Path, ids_by_split: Mapping[str, Iterable[str]]) -> None:
    """Write `<name>.txt` for every list, then SHA256SUMS over them.

    Parameters
    ----------
    directory
        Folder to write to. Made if it is not there.
    ids_by_split
        List name -> ids, as `compute_lists` gives them.

    Raises
    ------
    ValueError
        If a name is no plain lower-case word, or an id repeats within a list.
    """
    texts = {name: _text_of(name, ids) for name, ids in ids_by_split.items()}
    directory.mkdir(parents=True, exist_ok=True)
    sums = []
    for name, text in sorted(texts.items()):
        write_atomically(directory / f"{name}.txt", text)
        sums.append(f"{hashlib.sha256(text).hexdigest()}  {name}.txt\n")
    write_atomically(directory / CHECKSUMS, "".join(sums).encode())


def read_lists(directory: Path) -> dict[str, list[str]]:
    """Read the lists that SHA256SUMS names, and hold them to it.

    Parameters
    ----------
    directory
        Folder that `write_lists` wrote.

    Returns
    -------
    dict
        List name -> sorted ids.

    Raises
    ------
    FileNotFoundError
        If SHA256SUMS is missing.
    SplitListError
        If a file is missing, unnamed in SHA256SUMS, or differs from its checksum.
    """
    lists, problems = _read(directory)
    if problems:
        raise SplitListError("; ".join(problems))
    return lists


def check(
    directory: Path,
    ids: Iterable[str],
    params: SplitParams,
    lists: ListParams | None = None,
) -> list[str]:
    """Compare recorded lists with what the ids and parameters give.

    Parameters
    ----------
    directory
        Folder that `write_lists` wrote.
    ids
        Sample ids of the corpus, in any order.
    params
        Salt and fractions of the splits.
    lists
        What is chosen from the splits besides; nothing if None.

    Returns
    -------
    list of str
        One line per difference, naming the file or the id; empty if there is none.

    Raises
    ------
    FileNotFoundError
        If SHA256SUMS is missing.
    """
    return differences(directory, compute_lists(ids, params, lists))


def differences(directory: Path, expected: Mapping[str, Sequence[str]]) -> list[str]:
    """Compare recorded lists with those that they must be; see `check`."""
    recorded, problems = _read(directory)
    for name in expected:
        if name not in recorded:
            problems.append(f"{directory / CHECKSUMS}: does not name {name}.txt")
    for name in sorted(recorded.keys() - expected.keys()):
        problems.append(
            f"{directory / name}.txt: recorded, but the parameters ask for no such "
            "list; write the lists again"
        )
    problems += _moved(recorded, expected)
    for name in sorted((expected.keys() & recorded.keys()) - set(SPLITS)):
        problems += _differences(name, recorded[name], expected[name])
    return problems


def _moved(
    recorded: Mapping[str, Sequence[str]], expected: Mapping[str, Sequence[str]]
) -> list[str]:
    """Ids that are recorded in another split than theirs, in two, or in none."""
    problems = []
    places: dict[str, str] = {}
    for split in SPLITS:
        for sample_id in recorded.get(split, ()):
            if sample_id in places:
                problems.append(
                    f"{sample_id}: recorded twice, in {places[sample_id]} and {split}"
                )
            places[sample_id] = split
    belongs = {member: split for split in SPLITS for member in expected[split]}
    for sample_id in sorted(places.keys() | belongs.keys()):
        here, computed = places.get(sample_id), belongs.get(sample_id)
        if here is None:
            problems.append(f"{sample_id}: not recorded, belongs to {computed}")
        elif computed is None:
            problems.append(f"{sample_id}: recorded in {here}, not among the samples")
        elif here != computed:
            problems.append(f"{sample_id}: recorded in {here}, belongs to {computed}")
    return problems


def _differences(
    name: str, recorded: Sequence[str], expected: Sequence[str]
) -> list[str]:
    """Ids that a list of chosen samples has too many, too few, or twice."""
    counts = Counter(recorded)
    return [
        *(f"{i}: twice in {name}" for i, n in sorted(counts.items()) if n > 1),
        *(
            f"{i}: recorded in {name}, not chosen"
            for i in sorted(counts.keys() - set(expected))
        ),
        *(
            f"{i}: not recorded in {name}, but chosen"
            for i in sorted(set(expected) - counts.keys())
        ),
    ]


def _text_of(name: str, ids: Iterable[str]) -> bytes:
    if not _NAME.fullmatch(name):
        raise ValueError(
            f"split list {name!r}: a name must be lower-case letters, digits and "
            "underscores"
        )
    members = sorted(ids)
    for before, after in itertools.pairwise(members):
        if before == after:
            raise ValueError(f"split list {name!r}: {after!r} occurs twice")
    return "".join(f"{member}\n" for member in members).encode()


def _read(directory: Path) -> tuple[dict[str, list[str]], list[str]]:
    """Return the lists and what is wrong with their files."""
    lists: dict[str, list[str]] = {}
    problems = []
    try:
        sums = read_checksums(directory)
    except ChecksumError as error:
        return lists, [str(error)]
    for file, digest in sums.items():
        path = directory / file
        name = file.removesuffix(".txt")
        if file == name or not _NAME.fullmatch(name):
            problems.append(f"{path}: named in {CHECKSUMS}, but no list")
            continue
        lists[name] = []
        if not path.is_file():
            problems.append(f"{path}: missing, {CHECKSUMS} names it")
            continue
        data = path.read_bytes()
        found = hashlib.sha256(data).hexdigest()
        if found != digest:
            problems.append(
                f"{path}: sha256 {found[:12]}..., must be {digest[:12]}... as recorded "
                f"in {CHECKSUMS}; restore the file or write the lists again"
            )
        lists[name] = data.decode("utf-8", errors="replace").splitlines()
    strays = {path.stem for path in directory.glob("*.txt")} - lists.keys()
    for name in sorted(strays):
        problems.append(f"{directory / name}.txt: {CHECKSUMS} does not name it")
    return lists, problems
