"""Single rows of a release by their ids, here or on the Hub, and nothing else of it.

The index of a configuration says which bytes of which file hold a row; these are read,
held to their hash, and nothing else is.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import groupby
from pathlib import Path
from typing import Any

import datasets
import httpx2
import pyarrow as pa
from datasets.table import InMemoryTable

from mpmworlds.builder.release.layout import (
    PREVIEW,
    RECIPES,
    RECORD,
    Index,
    Record,
    index_path,
    parse_record,
)
from mpmworlds.files.checksums import ChecksumError
from mpmworlds.loaders.checked import check_batch
from mpmworlds.loaders.locate import (
    HUB_REPOSITORY,
    ReleaseNotFoundError,
    check_place,
    is_release,
)
from mpmworlds.loaders.missing import no_release, no_such_config
from mpmworlds.splits.ids import SampleId


@dataclass(frozen=True)
class Found:
    """Rows of a release, and where they were found."""

    rows: datasets.Dataset
    """In memory, in the order in which they were asked for."""
    config: str
    """Configuration that they are of."""
    namesakes: Callable[[str], list[str]]
    """Id -> configurations of other corpora that have another sample of it."""


def find_rows(
    place: str,
    ids: Sequence[str],
    config: str | None = None,
    revision: str | None = None,
) -> Found:
    """Read some rows of a release.

    Parameters
    ----------
    place
        Folder of the release, or a repository on the Hub.
    ids
        Of the rows, in the order in which they are wanted.
    config
        Configuration; without it, the first one with clips that has all of them, see
        `Record.in_order`: of the corpus `full` if there is one, as for all ids.
    revision
        Version of a repository.

    Returns
    -------
    Found
        The rows and their configuration.

    Raises
    ------
    ValueError
        If something is no id, or no configuration has them all.
    ReleaseNotFoundError
        If there is no release.
    ChecksumError
        If what is read is not as it was built.
    """
    if not ids or len(set(ids)) != len(ids):
        raise ValueError(f"ids = {list(ids)}, must be some, each of them once")
    for sample in ids:
        SampleId.parse(sample)
    check_place(place)
    if revision and is_release(Path(place)):
        raise ValueError(
            f"{place}: is a folder, which has no revision {revision!r}; name a "
            "repository on the Hub, or leave the revision out"
        )
    files = _Files(place, revision)
    record = parse_record(files.read(RECORD), RECORD)
    name, index = _having(files, record, ids, config)
    places = index.places()
    found: dict[str, pa.Table] = {}
    ordered = sorted(ids, key=lambda sample: places[sample])
    for number, samples in groupby(ordered, key=lambda sample: places[sample][0]):
        path, batch = index.at(number)
        data = files.read(path, batch.offset, batch.size)
        check_batch(data, path, batch)
        rows = pa.ipc.read_record_batch(pa.py_buffer(data), index.schema)
        for sample in samples:
            row = rows.slice(places[sample][1], 1)
            found[sample] = pa.Table.from_batches([row])
    table = pa.concat_tables([found[sample] for sample in ids])
    return Found(
        datasets.Dataset(InMemoryTable(table)),
        name,
        partial(_namesakes, cache(partial(_places, files)), record, name),
    )


def _having(
    files: "_Files", record: Record, ids: Sequence[str], config: str | None
) -> tuple[str, Index]:
    """The configuration to read, and its index."""
    if config is not None and config not in record.configs:
        raise ValueError(no_such_config(config, record.configs, files.place))
    tried = [config] if config else _in_order(record)
    lacking = ""
    for name in tried:
        index = _index(files, name)
        there = index.places()
        missing = [sample for sample in ids if sample not in there]
        if not missing:
            return name, index
        lacking = lacking or missing[0]
    where = f"configuration {config!r}" if config else f"any of {', '.join(tried)}"
    raise ValueError(
        f"{files.place}: {lacking} is not in {where}, or not together with all others; "
        f"to make it: mpmworlds regenerate {lacking}"
    )


def _in_order(record: Record) -> list[str]:
    """Configurations that have clips."""
    return [name for name in record.in_order() if name not in (RECIPES, PREVIEW)]


def _index(files: "_Files", config: str) -> Index:
    return Index(files.read(index_path(config)), index_path(config))


def _places(files: "_Files", config: str) -> dict[str, tuple[int, int]]:
    return _index(files, config).places()


def _namesakes(
    places: Callable[[str], Collection[str]], record: Record, config: str, sample: str
) -> list[str]:
    others = record.of_other_corpora(config)
    return [name for name in others if sample in places(name)]


class _Files:
    """Files of a release, in a folder or on the Hub, and parts of them."""

    def __init__(self, place: str, revision: str | None) -> None:
        self.place = place
        self._system: Any = None
        self._root = place
        if not is_release(Path(place)):
            from huggingface_hub import HfFileSystem

            self._system = HfFileSystem()
            at = f"@{revision}" if revision else ""
            self._root = f"datasets/{place}{at}"

    def read(self, path: str, offset: int = 0, size: int | None = None) -> bytes:
        """Bytes of a file, all from the offset on if there is no size."""
        where = f"{self._root}/{path}"
        try:
            with self._opened(where) as stream:
                stream.seek(offset)
                return bytes(stream.read(-1 if size is None else size))
        except (ConnectionError, httpx2.TransportError) as error:
            reason = str(error).partition("\n")[0]
            if self.place == HUB_REPOSITORY:
                raise ReleaseNotFoundError(no_release(reason)) from None
            raise ConnectionError(
                f"{self.place}: the Hub cannot be reached ({reason}); try again, or "
                "name the folder of a release"
            ) from None
        except FileNotFoundError as error:
            if path == RECORD and self.place == HUB_REPOSITORY:
                reason = f"it has no {self.place}, or that has no {RECORD}"
                raise ReleaseNotFoundError(no_release(reason)) from error
            if path == RECORD:
                raise ReleaseNotFoundError(
                    f"{self.place}: is no release ({path} is not there)"
                ) from error
            raise ChecksumError(
                f"{where}: is missing; fetch or build the release again"
            ) from error

    def _opened(self, where: str) -> Any:
        if self._system:
            return self._system.open(where, "rb", cache_type="none")
        return Path(where).open("rb")
