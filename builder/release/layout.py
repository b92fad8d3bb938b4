"""What lies where in a release, and the record that says what it consists of.

Builders write it, loaders read it: this is the contract between them. The name of a
configuration decides its columns.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import pyarrow as pa
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mpmworlds.files.targets import refuse_file

RECORD: Final = "release.json"
CARD: Final = "README.md"
INDEX: Final = "index.arrow"
SPLIT_LISTS: Final = "splits"
MAIN: Final = "full"  # the corpus of the benchmark: ids that others have, too, are its
RECIPES: Final = "recipes"  # all rows of the corpus, without program and video
PREVIEW: Final = "preview"  # videos for eyes
CLIPS: Final = "-clips"  # ends the name of a configuration without full videos
CONTENT: Final = "content sha256:"  # begins the description of each configuration
_SCHEMA: Final = b"schema of the rows"  # key in the metadata of an index
_INDEX: Final = pa.schema(
    [
        pa.field("path", pa.string(), nullable=False),
        pa.field("split", pa.string(), nullable=False),
        pa.field("offset", pa.int64(), nullable=False),
        pa.field("size", pa.int64(), nullable=False),
        pa.field("sha256", pa.binary(32), nullable=False),
        pa.field("ids", pa.list_(pa.string()), nullable=False),
    ]
)


class LayoutError(ValueError):
    """A record or an index that is none of a release."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class FileRecord(_Part):
    """A file of rows."""

    path: str
    """Inside the release."""
    split: str
    rows: int = Field(ge=0)
    num_bytes: int = Field(ge=0)
    """In memory."""
    size: int = Field(ge=0)
    """On disk. [byte]"""
    sha256: str


class ConfigRecord(_Part):
    """A configuration."""

    corpus: str
    """Whose rows it has."""
    key: str
    """Hash of all that decides its bytes."""
    files: list[FileRecord]


class Record(_Part):
    """What a release consists of: the content of ``release.json``."""

    dataset: Literal["mpmworlds"] = "mpmworlds"
    version: str
    """Of the data."""
    renderer: str
    """What turned programs into videos."""
    default: str
    """Configuration that is loaded if none is named."""
    corpora: dict[str, str]
    """Name -> hash of its manifest."""
    configs: dict[str, ConfigRecord]

    def text(self) -> str:
        """The file."""
        return json.dumps(self.model_dump(), indent=1) + "\n"

    def files(self) -> list[FileRecord]:
        """Files of rows of all configurations."""
        return [file for config in self.configs.values() for file in config.files]

    def in_order(self) -> list[str]:
        """Configurations in the order in which a sample is looked for in them.

        Those with clips before the others; of either those of the corpus `MAIN` first,
        and of these the ones with full videos.
        """

        def place(name: str) -> tuple[bool, bool, bool, str]:
            return (
                name in (RECIPES, PREVIEW),
                self.configs[name].corpus != MAIN,
                name.endswith(CLIPS),
                name,
            )

        return sorted(self.configs, key=place)

    def of_other_corpora(self, config: str) -> list[str]:
        """Configurations of other corpora, which may have other samples of an id."""
        own = self.configs[config].corpus
        return [name for name in self.in_order() if self.configs[name].corpus != own]

    def digest(self, config: str) -> str:
        """Hash of the content of a configuration."""
        files = self.configs[config].files
        lines = "".join(f"{file.sha256}  {file.path}\n" for file in files)
        return hashlib.sha256(lines.encode()).hexdigest()


def read_record(root: Path) -> Record:
    """Read what a release consists of.

    Raises
    ------
    FileNotFoundError
        If the folder has no such file.
    NotADirectoryError
        If it is no folder but a file.
    LayoutError
        If it is none, or of a later version of this package.
    """
    refuse_file(root)
    path = root / RECORD
    if not path.is_file():
        raise FileNotFoundError(
            f"{path}: is not there; name the folder of a release, or build one with "
            f"`mpmworlds build --out {root}`"
        )
    return parse_record(path.read_bytes(), str(path))


def parse_record(data: bytes, where: str) -> Record:
    """Read the content of a record; see `read_record`."""
    try:
        return Record.model_validate_json(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the file"
        raise LayoutError(
            f"{where}: {place}: {first['msg']}; fetch or build the release again, or "
            "install the version of mpmworlds that made it"
        ) from None


@dataclass(frozen=True)
class Batch:
    """Rows that lie together in a file: the least that is read and checked.

    Attributes
    ----------
    offset, size
        Where in the file. [byte]
    sha256
        Of these bytes.
    ids
        Of the rows, in order.
    """

    offset: int
    size: int
    sha256: bytes
    ids: tuple[str, ...]


def index_path(config: str) -> str:
    """Path of the index of a configuration, inside the release."""
    return f"data/{config}/{INDEX}"


def index_bytes(
    schema: pa.Schema, files: Sequence[tuple[FileRecord, Sequence[Batch]]]
) -> bytes:
    """An index: where the rows of a configuration lie, and the hash of each batch."""
    rows: list[dict[str, Any]] = [
        {"path": file.path, "split": file.split} | vars(batch)
        for file, batches in files
        for batch in batches
    ]
    whole = _INDEX.with_metadata({_SCHEMA: schema.serialize().to_pybytes()})
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression="zstd")
    with pa.ipc.new_stream(sink, whole, options=options) as writer:
        writer.write_table(pa.Table.from_pylist(rows, schema=whole))
    return bytes(sink.getvalue())


class Index:
    """Where the rows of a configuration lie.

    Parameters
    ----------
    data
        What `index_bytes` made.
    where
        Names it in errors.

    Raises
    ------
    LayoutError
        If it is no index.
    """

    def __init__(self, data: bytes, where: str) -> None:
        try:
            self.table = pa.ipc.open_stream(data).read_all()
            found = self.table.schema
            self.schema = pa.ipc.read_schema(pa.py_buffer(found.metadata[_SCHEMA]))
        except (KeyError, TypeError, OSError, pa.ArrowException) as error:
            raise LayoutError(
                f"{where}: is no index of a release ({error}); fetch or build the "
                "release again"
            ) from None
        if not found.equals(_INDEX):
            raise LayoutError(f"{where}: has other columns than an index")

    def files(self) -> dict[str, str]:
        """Path of each file -> its split."""
        columns = (self.table[name].to_pylist() for name in ("path", "split"))
        return dict(zip(*columns, strict=True))

    def batches(self) -> dict[str, list[Batch]]:
        """Path of each file -> its batches, in order."""
        found: dict[str, list[Batch]] = {}
        for row in self.table.to_pylist():
            found.setdefault(row["path"], []).append(_batch(row))
        return found

    def places(self) -> dict[str, tuple[int, int]]:
        """Id -> number of its batch among all, and of its row in that."""
        return {
            sample: (number, row)
            for number, ids in enumerate(self.table["ids"].to_pylist())
            for row, sample in enumerate(ids)
        }

    def at(self, number: int) -> tuple[str, Batch]:
        """Path of the file of a batch, and the batch."""
        row = self.table.slice(number, 1).to_pylist()[0]
        return str(row["path"]), _batch(row)


def _batch(row: dict[str, Any]) -> Batch:
    return Batch(row["offset"], row["size"], row["sha256"], tuple(row["ids"]))
