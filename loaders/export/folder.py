"""An export in the making: files for each sample, and then one line that names them.

A stopped export goes on after its last whole line; the list takes its name only when
it is complete. What it was made of is noted beside it, and another export is refused.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds import __version__
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.checksums import CHECKSUMS, sha256_of_file
from mpmworlds.files.journal import Journal
from mpmworlds.files.targets import check_folder
from mpmworlds.loaders.load import Examples, load
from mpmworlds.loaders.locate import check_place
from mpmworlds.loaders.processes import in_order

Record = dict[str, Any]
Write = Callable[[Examples, int, Path], Record]


@dataclass(frozen=True)
class Source:
    """Which samples are exported, and what is told of them."""

    release: Path
    config: str
    split: str
    regime: str

    def load(self) -> Examples:
        """Load them; see `mpmworlds.load`."""
        return load(self.release, self.split, self.config, self.regime)

    def noted(self) -> Record:
        """What they are, whatever the release's place."""
        check_place(str(self.release.absolute()))
        return {
            "mpmworlds": __version__,
            "release": sha256_of_file(self.release / CHECKSUMS),
            "config": self.config,
            "split": self.split,
            "regime": self.regime,
        }


def place_of(name: str, suffix: str) -> str:
    """Path of a file of a sample within a folder that may get very many."""
    return f"{name[:2]}/{name}{suffix}"


def write_export(
    source: Source,
    settings: Record,
    out_dir: Path,
    name: str,
    write: Write,
    *,
    render: Callable[[Sequence[Record]], bytes] | None = None,
    limit: int | None = None,
    workers: int = 1,
) -> int:
    """Export samples, or go on with it.

    Parameters
    ----------
    source
        The samples.
    settings
        What else the files depend on; `form` names the kind of export.
    out_dir
        Folder of the export; what it was made of is noted in
        ``FORM-SPLIT.made_of.json``.
    name
        Path of the list in that folder; other files lie beside it.
    write
        Writes the files of one sample, given examples, an index and the folder of the
        list, and returns its record. A function that pickles.
    render
        Text of the list, given all records; a JSON object a line if left out.
    limit
        Only so many samples, the first ones.
    workers
        Number of processes, 0 for one per core. The bytes do not depend on it.

    Returns
    -------
    int
        Number of samples in the list.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    ValueError
        If the folder holds another export of that name, or there is no such sample.
    """
    if limit is not None and limit < 1:
        raise ValueError(f"limit = {limit}, must be at least 1")
    if workers < 0:
        raise ValueError(f"workers = {workers}, must be >= 0 (0: one per core)")
    check_folder(out_dir)
    count = len(source.load())
    count = count if limit is None else min(count, limit)
    note = out_dir / f"{settings['form']}-{source.split}.made_of.json"
    target = out_dir / name
    made_of = source.noted() | settings | {"samples": count}
    if target.is_file():
        _check(note, made_of)
        return count
    part = target.with_name(f".{target.name}.part")
    with Journal(part) as journal:
        ends = [end for _, _, end in journal.lines()]
        journal.cut(ends[-1] if ends else 0)
        if ends:
            _check(note, made_of)
        else:  # whatever failed before its first sample was done may be tried otherwise
            write_atomically(note, _text(made_of))
        rest = range(len(ends), count)
        work = partial(_work, source, write, target.parent)
        with tqdm(desc="export", unit="sample", total=count, initial=len(ends)) as bar:
            for record in in_order(work, rest, workers):
                journal.append(f"{json.dumps(record, ensure_ascii=False)}\n")
                bar.update()
        if render is None:
            part.replace(target)
        else:
            records = [json.loads(line) for _, line, _ in journal.lines()]
            write_atomically(target, render(records))
            part.unlink()
    return count


def _text(made_of: Record) -> bytes:
    return (json.dumps(made_of, indent=2, sort_keys=True) + "\n").encode()


def _check(note: Path, made_of: Record) -> None:
    """Refuse to go on with another export."""
    known = json.loads(note.read_bytes())
    differs = [key for key in made_of if made_of[key] != known.get(key)]
    if differs:
        told = ", ".join(f"{key} = {known.get(key)!r}" for key in differs)
        raise ValueError(
            f"{note.parent}: holds an export of {told}; name another folder, or remove "
            "that one"
        )


def _work(source: Source, write: Write, folder: Path, index: int) -> Record:
    return write(_loaded(source), index, folder)


@cache
def _loaded(source: Source) -> Examples:
    """Examples of a source, loaded once in a process."""
    return source.load()
