"""Splits of a local release, mapped into memory as they lie there."""

import hashlib
import logging
import secrets
from collections.abc import Sequence
from pathlib import Path

import datasets
from datasets.arrow_reader import ReadInstruction

from mpmworlds.builder.release.layout import RECORD, Record, index_path, read_record
from mpmworlds.files.checksums import CHECKSUMS, ChecksumError, read_checksums
from mpmworlds.loaders.integrity import cache_folder, check_release
from mpmworlds.loaders.missing import no_such_config

_log = logging.getLogger(__name__)


def mapped(root: Path, config: str | None, split: str) -> datasets.Dataset:
    """Rows of a split, a part of one, or a sum of these.

    Parameters
    ----------
    root
        Folder of the release.
    config
        Configuration; the default one of the release if None.
    split
        As for ``load_dataset``, e.g. ``"test[:10]+train"``.

    Raises
    ------
    ValueError
        If the release has no such configuration or split, or the split is no such text.
    ChecksumError
        If a file that is needed is not as it was built.
    """
    record = read_record(root)
    name = chosen_config(record, config, root)
    rows: dict[str, int] = {}
    for file in record.configs[name].files:
        rows[file.split] = rows.get(file.split, 0) + file.rows
    parts = []
    try:
        instructions = ReadInstruction.from_spec(split).to_absolute(rows)
    except ValueError as error:
        there = ", ".join(_all_splits(record))
        raise ValueError(
            f"{root}: has no split {name}/{split}; it has {there} ({error})"
        ) from None
    for part in instructions:
        whole = _whole_split(root, record, name, part.splitname)
        if (part.from_, part.to) == (None, None):
            parts.append(whole)
        else:
            start, stop, _ = slice(part.from_, part.to).indices(len(whole))
            parts.append(whole.select(range(start, stop)))
    return datasets.concatenate_datasets(parts) if parts[1:] else parts[0]


def _all_splits(record: Record) -> list[str]:
    configs = sorted(record.configs.items())
    return [f"{n}/{s}" for n, c in configs for s in sorted({f.split for f in c.files})]


def chosen_config(record: Record, config: str | None, root: Path) -> str:
    """The configuration that is named, or the default one."""
    if config is None:
        return record.default
    if config not in record.configs:
        raise ValueError(no_such_config(config, record.configs, str(root)))
    return config


def _whole_split(
    root: Path, record: Record, config: str, split: str
) -> datasets.Dataset:
    chosen = [file for file in record.configs[config].files if file.split == split]
    files = [file.path for file in chosen]
    sums = read_checksums(root)
    for file in chosen:
        if sums.get(file.path, file.sha256) != file.sha256:
            raise ChecksumError(
                f"{root / file.path}: {RECORD} and {CHECKSUMS} tell it by different "
                "hashes; fetch or build the release again"
            )
    check_release(root, [*files, index_path(config)])
    places = _linked(root, files, record.digest(config))
    parts = [datasets.Dataset.from_file(str(place)) for place in places]
    return datasets.concatenate_datasets(parts)


def _linked(root: Path, files: Sequence[str], digest: str) -> list[Path]:
    """Links to files of a release, in a folder of the user.

    What `map` and `filter` cache, `datasets` writes beside the files that it maps. A
    release may be read-only, and is damaged by what does not belong to it.
    """
    key = hashlib.sha256(f"{root.resolve()}\n{digest}".encode()).hexdigest()[:32]
    folder = cache_folder() / "mapped" / key
    links = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for file in files:
            link, target = folder / Path(file).name, (root / file).resolve()
            if not (link.is_symlink() and link.resolve() == target):
                part = link.with_name(f".{link.name}.{secrets.token_hex(4)}")
                part.symlink_to(target)
                part.replace(link)
            links.append(link)
    except OSError as error:  # no home, or no links
        _log.info("%s: no links (%s); `map` caches beside the files", folder, error)
        return [root / file for file in files]
    return links
