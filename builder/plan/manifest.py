"""The manifest: one row per sample, with its scene, lineage, split and hashes.

It is the dataset in a few megabytes: everything else in a release follows from it.
"""

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from mpmworlds.files.parquet import write_parquet
from mpmworlds.metrics import SCORED
from mpmworlds.splits.ids import SAMPLE_KINDS


class ManifestError(ValueError):
    """A file that is no manifest, or a manifest that contradicts itself."""


@dataclass(frozen=True)
class ManifestRow:
    """One sample of the corpus.

    Attributes
    ----------
    id
        Stable name that says the lineage, e.g. ``p0123-c4-n07``.
    kind
        A member of ``SAMPLE_KINDS``.
    parent_id
        Id of the row it was made from, "" for seeds and parents.
    family_id
        Id of the root, e.g. ``p0123``.
    seeds
        Names of the seed scenes it descends from.
    edit
        JSON of the operator that made it and its arguments, "" for seeds.
    split
        Name of the split it belongs to.
    scene
        YAML text of the scene.
    materials, object_types
        Distinct constitutive models and object types of the scene, sorted.
    num_objects, num_materials
        How many objects and distinct materials the scene has.
    motion
        Part of the foreground that changes in a second after the prefix, see
        `measures.motion`: by a full run for the samples to evaluate on, by a trial for
        other templates, else None.
    ceiling
        Noise ceiling of each metric: its value between the continuation and those of
        runs that start from places which differ by nothing that can be known; None
        where it has not been measured.
    scene_sha256, program_sha256
        SHA-256 of the scene text and of the program text that implements it.
    """

    id: str
    kind: str
    parent_id: str
    family_id: str
    seeds: tuple[str, ...]
    edit: str
    split: str
    scene: str
    materials: tuple[str, ...]
    object_types: tuple[str, ...]
    num_objects: int
    num_materials: int
    motion: float | None
    ceiling: Mapping[str, float] | None
    scene_sha256: str
    program_sha256: str


_WORDS = pa.list_(pa.string())
_ARROW: Final = {"seeds": _WORDS, "materials": _WORDS, "object_types": _WORDS} | {
    "num_objects": pa.int32(),
    "num_materials": pa.int32(),
    "motion": pa.float64(),
    "ceiling": pa.struct([(name, pa.float64()) for name in SCORED]),
}
_NULLABLE: Final = ("motion", "ceiling")
SCHEMA: Final = pa.schema(
    [
        pa.field(f.name, _ARROW.get(f.name, pa.string()), nullable=f.name in _NULLABLE)
        for f in fields(ManifestRow)
    ]
)


def text_sha256(text: str) -> str:
    """Return the SHA-256 of a text's UTF-8 bytes, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def operator_of(edit: str) -> str:
    """Name of the operator in the column ``edit``, not empty; raises `ValueError`."""
    record = json.loads(edit)
    if not isinstance(record, dict) or not isinstance(record.get("operator"), str):
        raise ValueError(
            f"edit {edit[:60]!r}: must be a JSON object that names its 'operator'"
        )
    return str(record["operator"])


def write_manifest(path: Path, rows: Sequence[ManifestRow]) -> None:
    """Write a manifest as Parquet: the same bytes for the same rows.

    Parameters
    ----------
    path
        File to write. Its folder is made if it is not there.
    rows
        The samples, in the order in which they are to be released.

    Raises
    ------
    ManifestError
        If an id occurs twice, a kind is unknown, or a scene is not the one that
        ``scene_sha256`` names.
    """
    _check_rows(rows, str(path))
    table = pa.Table.from_pylist([asdict(row) for row in rows], schema=SCHEMA)
    write_parquet(path, table, compression_level=9)


def read_manifest(path: Path, ids: Collection[str] | None = None) -> list[ManifestRow]:
    """Read a manifest and check that it is one.

    Parameters
    ----------
    path
        File that ``write_manifest`` wrote.
    ids
        Samples whose rows are read and checked; those that it does not have are left
        out. All rows if None.

    Returns
    -------
    list of ManifestRow
        The samples, in the order of the file.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ManifestError
        If the file is no Parquet file, has other columns, or contradicts itself.
    """
    table = read_table(path)
    if ids is not None:
        among = pa.array(sorted(ids), pa.string())
        table = table.filter(pc.is_in(table["id"], among))
    rows = [_row_of(record) for record in table.to_pylist()]
    _check_rows(rows, str(path))
    return rows


def _recorded() -> Any:
    return files("mpmworlds.builder").joinpath("recorded")


def recorded_corpora() -> list[str]:
    """Names of the corpora whose manifests come with the package."""
    folder, suffix = _recorded(), ".parquet"
    names = [file.name for file in folder.iterdir()] if folder.is_dir() else []
    there = sorted(n.removesuffix(suffix) for n in names if n.endswith(suffix))
    return [name for name in there if "." not in name]  # else of its trials


def recorded_manifest(config: str) -> Path:
    """Where the manifest is that comes with the package.

    Parameters
    ----------
    config
        Name of the corpus, such as ``full``.

    Returns
    -------
    Path
        A file of `write_manifest`.

    Raises
    ------
    LookupError
        If the package has none of that name.
    """
    found = _recorded().joinpath(f"{config}.parquet")
    if not found.is_file():
        raise LookupError(
            f"there is no recorded manifest of {config!r}, only of "
            f"{recorded_corpora()}; choose "
            f"another --config, or plan one: mpmworlds plan --config {config} --out "
            "FILE, and name it with --manifest FILE"
        )
    return Path(str(found))


def read_table(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Read columns of a manifest as they are: fast, and without checking the rows.

    Parameters
    ----------
    path
        File that ``write_manifest`` wrote.
    columns
        Names of the columns to read; all if None.

    Returns
    -------
    pyarrow.Table
        Those columns, with the rows in the order of the file.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ManifestError
        If the file is no Parquet file or has other columns than a manifest.
    """
    try:
        with pq.ParquetFile(path) as file:
            _check_columns(file.schema_arrow, path)
            return file.read(columns=columns)
    except pa.ArrowInvalid as error:
        raise ManifestError(
            f"{path}: no readable Parquet file ({error}); write the manifest again"
        ) from error


def _row_of(record: dict[str, object]) -> ManifestRow:
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in record.items()}
    return ManifestRow(**values)  # type: ignore[arg-type]  # the schema was checked


def _check_columns(found: pa.Schema, path: Path) -> None:
    problems = [
        f"column {name!r} is missing"
        for name in SCHEMA.names
        if name not in found.names
    ]
    for field in found:
        if field.name not in SCHEMA.names:
            problems.append(f"column {field.name!r} is unknown")
        elif field.type != SCHEMA.field(field.name).type:
            expected = SCHEMA.field(field.name).type
            problems.append(
                f"column {field.name!r} is {field.type}, must be {expected}"
            )
    if problems:
        raise ManifestError(
            f"{path}: {'; '.join(problems)}; write the manifest with this version of "
            "mpmworlds"
        )


def _check_rows(rows: Sequence[ManifestRow], source: str) -> None:
    seen = set()
    for row in rows:
        where = f"{source}: row {row.id!r}"
        if row.id in seen:
            raise ManifestError(f"{where}: occurs twice, ids must be unique")
        seen.add(row.id)
        if row.kind not in SAMPLE_KINDS:
            raise ManifestError(
                f"{where}: kind = {row.kind!r}, must be one of "
                f"{', '.join(SAMPLE_KINDS)}"
            )
        if text_sha256(row.scene) != row.scene_sha256:
            raise ManifestError(
                f"{where}: the scene's sha256 is {text_sha256(row.scene)[:12]}..., "
                f"scene_sha256 says {row.scene_sha256[:12]}...; plan the row again"
            )
