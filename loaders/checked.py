"""Rows of a release through ``datasets``, each record batch checked as it is read.

This is the ``arrow`` builder of ``datasets`` with one thing more: what the index of a
configuration says. A batch whose bytes are not those that were built, one too many or
too few, a file that is missing or stands in another's place: none is ever served, from
a folder, from the Hub or from a stream.
"""

import hashlib
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Any, Final

import datasets
import pyarrow as pa
from datasets.builder import Key
from datasets.exceptions import DatasetGenerationError
from datasets.packaged_modules.arrow.arrow import Arrow

from mpmworlds.builder.release.layout import RECORD, Batch, Index, index_path
from mpmworlds.files.checksums import CHECKSUMS, ChecksumError
from mpmworlds.loaders.missing import no_such_config

_AGAIN: Final = "fetch or build the release again"


class Release(Arrow):  # type: ignore[misc]  # untyped library
    """Builder of the configurations of a release; see the module."""

    def _create_builder_config(
        self, config_name: str | None = None, *args: Any, **kwargs: Any
    ) -> Any:
        there = [config.name for config in self.BUILDER_CONFIGS]
        if config_name is not None and config_name not in there:
            raise ValueError(no_such_config(config_name, there, str(self.base_path)))
        return super()._create_builder_config(config_name, *args, **kwargs)

    def _prepare_split(self, *args: Any, **kwargs: Any) -> Any:
        try:
            return super()._prepare_split(*args, **kwargs)
        except DatasetGenerationError as error:
            if isinstance(error.__cause__, ChecksumError):
                raise error.__cause__ from None
            raise

    def _split_generators(
        self, dl_manager: datasets.DownloadManager
    ) -> list[datasets.SplitGenerator]:
        path = index_path(self.config.name)
        root = str(self.base_path).rstrip("/")
        place = ""
        for small in (RECORD, CHECKSUMS, path):  # with all, it loads offline, too
            try:
                place = dl_manager.download(f"{root}/{small}")
            except FileNotFoundError:
                raise ChecksumError(f"{root}/{small}: is missing; {_AGAIN}") from None
        with open(place, "rb") as stream:  # may be a URL
            index = Index(stream.read(), path)
        found = {
            split: {_name_in_release(file): file for file in files}
            for split, files in self.config.data_files.items()
        }
        self._check_names(found, index)
        batches = index.batches()
        schema = index.schema.serialize().to_pybytes()
        return [
            datasets.SplitGenerator(
                name=split,
                gen_kwargs={
                    "files": dl_manager.download(list(files.values())),
                    "names": list(files),
                    "batches": [batches[name] for name in files],
                    "schema": schema,
                },
            )
            for split, files in found.items()
        ]

    def _check_names(self, found: dict[str, dict[str, str]], index: Index) -> None:
        """Raise unless the files of each split are those that were built."""
        built = index.files()
        here = {name: split for split, names in found.items() for name in names}
        for name in sorted(built.keys() | here.keys()):
            if built.get(name) != here.get(name):
                what = "is missing" if name not in here else "does not belong there"
                raise ChecksumError(f"{self.base_path}/{name}: {what}; {_AGAIN}")

    def _generate_shards(self, files: list[str], **_: Any) -> Iterator[str]:
        yield from files

    def _generate_tables(
        self,
        files: list[str],
        names: list[str],
        batches: list[list[Batch]],
        schema: bytes,
    ) -> Iterator[tuple[Any, pa.Table]]:
        rows = pa.ipc.read_schema(pa.py_buffer(schema))
        for number, (file, name) in enumerate(zip(files, names, strict=True)):
            with open(file, "rb") as stream:  # may be a URL
                for at, data in enumerate(checked(stream, name, batches[number])):
                    batch = pa.ipc.read_record_batch(pa.py_buffer(data), rows)
                    table = pa.Table.from_batches([batch])
                    yield Key(number, at), self._cast_table(table)


def checked(stream: Any, name: str, batches: list[Batch]) -> Iterator[bytes]:
    """The record batches of a file, in order, each held to its hash.

    Raises
    ------
    ChecksumError
        If one is not as it was built; before it is given away.
    """
    position = 0
    for batch in batches:
        stream.read(batch.offset - position)
        data = stream.read(batch.size)
        position = batch.offset + batch.size
        check_batch(data, name, batch)
        yield data


def check_batch(data: bytes, name: str, batch: Batch) -> None:
    """Raise `ChecksumError` unless the bytes of a batch are those that were built."""
    if hashlib.sha256(data).digest() != batch.sha256:
        rows = batch.ids[0] if len(batch.ids) == 1 else f"{batch.ids[0]} and others"
        raise ChecksumError(
            f"{name}: the bytes of {rows} are not those that were built; {_AGAIN}"
        )


def _name_in_release(file: str) -> str:
    """Path of a file inside the release, from where it is or its URL."""
    return str(PurePosixPath(*PurePosixPath(file).parts[-3:]))
