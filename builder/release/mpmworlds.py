"""The ``datasets`` builder of a release: schema, files, examples, nothing else."""

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeAlias

import datasets
import pyarrow as pa
from datasets.table import cast_array_to_feature

from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import PREVIEW, RECIPES, Batch
from mpmworlds.builder.render.store import Store, StoredSample
from mpmworlds.metrics.reduction import reduced_framerate
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.run.preview import encode_preview, poster

# Rows a record batch. Small, because a batch is held in memory and is the least that a
# reader fetches and checks (python -m benchmarks.loading.formats).
BATCH_ROWS: Final = 4
RECIPE_BATCH_ROWS: Final = 2000

Shard: TypeAlias = pa.Table  # rows of a manifest


class NotRenderedError(LookupError):
    """A row whose video is not in the store."""


@dataclass
class MPMWorldsConfig(datasets.BuilderConfig):  # type: ignore[misc]  # untyped library
    """Which rows go into which file.

    Attributes
    ----------
    shards
        Split name -> the rows of each of its files, in order.
    store
        Folder of the rendered samples; the configuration ``recipes`` needs none.
    """

    shards: Mapping[str, Sequence[Shard]] = field(default_factory=dict)
    store: Path | None = None


class MPMWorlds(datasets.GeneratorBasedBuilder):  # type: ignore[misc]  # untyped library
    """Rows of a manifest, with their programs and videos from a store.

    One file is written for every planned shard, so the files do not depend on how many
    processes write them.
    """

    BUILDER_CONFIG_CLASS = MPMWorldsConfig
    config: MPMWorldsConfig

    def __init__(self, *args: object, **kwargs: object) -> None:
        kwargs.setdefault("dataset_name", "mpmworlds")
        super().__init__(*args, **kwargs)

    def _info(self) -> datasets.DatasetInfo:
        return datasets.DatasetInfo(
            features=features_of(self.config.name), license="cc-by-4.0"
        )

    def _split_generators(
        self, dl_manager: datasets.DownloadManager
    ) -> list[datasets.SplitGenerator]:
        return [
            datasets.SplitGenerator(name=split, gen_kwargs={"shards": list(shards)})
            for split, shards in self.config.shards.items()
        ]

    def _generate_examples(
        self, shards: Sequence[Shard]
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        for shard in shards:
            for row in shard.to_pylist():
                yield row["id"], self._example(row)

    def _example(self, row: dict[str, Any]) -> dict[str, Any]:
        if self.config.store is None:
            return row
        sample = Store(self.config.store).get(row["program_sha256"])
        if sample is None:
            raise NotRenderedError(
                f"{row['id']}: its video is not in the store {self.config.store}, or "
                "is corrupt there; materialise the manifest again"
            )
        found = _previewed if self.config.name == PREVIEW else _rendered
        columns = row | found(row["id"], sample)
        return {name: columns[name] for name in self.info.features}

    def write_shard(self, shard: Shard, path: Path) -> tuple[int, list[Batch]]:
        """Write the rows of one shard as an Arrow IPC stream.

        The bytes are those of ``datasets.arrow_writer.ArrowWriter``; writing them here
        spares each process the import of torch that encoding a video feature may bring.
        Recipes are compressed, which leaves an eighth of them.

        Parameters
        ----------
        shard
            The rows.
        path
            File to write.

        Returns
        -------
        tuple
            Number of bytes in memory, and where its rows lie.

        Raises
        ------
        NotRenderedError
            If the store lacks a row's video.
        """
        schema = self.info.features.arrow_schema
        compression = "zstd" if self.config.name == RECIPES else None
        options = pa.ipc.IpcWriteOptions(compression=compression)
        with (
            pa.OSFile(str(path), "wb") as file,
            pa.ipc.new_stream(file, schema, options=options) as writer,
        ):
            for batch in self._batches(shard):
                writer.write_batch(batch)
        return _found(path)

    def _batches(self, shard: Shard) -> Iterator[pa.RecordBatch]:
        schema = self.info.features.arrow_schema
        if self.config.name == RECIPES:  # as they are in the manifest
            for batch in shard.cast(schema).to_batches(RECIPE_BATCH_ROWS):
                yield self._as_datasets_has_it(_with_plain_nulls(batch))
            return
        for start in range(0, len(shard), BATCH_ROWS):
            examples = self._generate_examples([shard.slice(start, BATCH_ROWS)])
            rows = [example for _, example in examples]
            yield self._as_datasets_has_it(
                pa.RecordBatch.from_pylist(rows, schema=schema)
            )

    def _as_datasets_has_it(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """The batch with nulls inside of structures that are null."""
        features = self.info.features
        columns = [
            cast_array_to_feature(column, feature)
            if isinstance(feature, dict)
            else column
            for column, feature in zip(batch.columns, features.values(), strict=True)
        ]
        return pa.RecordBatch.from_arrays(columns, schema=features.arrow_schema)

    def _prepare_split_single(
        self,
        gen_kwargs: dict[str, Any],
        fpath: str,
        file_format: str,
        max_shard_size: int,
        split_info: datasets.SplitInfo,
        job_id: int,
    ) -> Iterator[tuple[int, bool, Any]]:
        """Write one file per planned shard, whatever process this is."""
        if file_format != "arrow":
            raise ValueError(f"file_format = {file_format!r}, must be 'arrow'")
        rows, size = [], 0
        for number, shard in enumerate(gen_kwargs["shards"]):
            path = fpath.replace("SSSSS", f"{number:05d}")
            path = path.replace("JJJJJ", f"{job_id:05d}")
            num_bytes, _ = self.write_shard(shard, Path(path + ".part"))
            os.replace(path + ".part", path)
            rows.append(len(shard))
            size += num_bytes
            yield job_id, False, len(shard)
        features, files = self.info.features, len(rows)
        yield job_id, True, (sum(rows), size, features, files, rows, files, list(rows))


def _with_plain_nulls(batch: pa.RecordBatch) -> pa.RecordBatch:
    """The batch with zeros where a value is null: what lies there may vary."""
    columns = [
        pa.array(column.to_pylist(), column.type) if column.null_count else column
        for column in batch.columns
    ]
    return pa.RecordBatch.from_arrays(columns, schema=batch.schema)


def _rendered(name: str, sample: StoredSample) -> dict[str, Any]:
    return {
        "program": sample.program,
        "video": {"bytes": sample.video, "path": f"{name}.mp4"},
        "clip": {"bytes": sample.clip, "path": f"{name}.clip.mp4"},
        "frames_sha256": sample.description.frames_sha256,
        "num_frames": sample.description.num_frames,
        "framerate": sample.description.framerate,
        "resolution": sample.description.resolution,
    }


def _previewed(name: str, sample: StoredSample) -> dict[str, Any]:
    framerate = reduced_framerate(sample.description.framerate)
    frames = decode_mp4(sample.clip)
    return {
        "preview": {
            "bytes": encode_preview(frames, framerate),
            "path": f"{name}.preview.mp4",
        },
        "poster": {"bytes": poster(frames), "path": f"{name}.png"},
    }


def _found(path: Path) -> tuple[int, list[Batch]]:
    """Bytes in memory of an Arrow IPC stream, and where its record batches lie."""
    found = []
    with pa.memory_map(str(path)) as source:
        batches = list(pa.ipc.open_stream(source))
        ids = [tuple(batch.column("id").to_pylist()) for batch in batches]
        source.seek(0)
        pa.ipc.read_message(source)  # the schema
        for names in ids:
            start = source.tell()
            pa.ipc.read_message(source)
            size = source.tell() - start
            source.seek(start)
            digest = hashlib.sha256(source.read_buffer(size)).digest()
            found.append(Batch(start, size, digest, names))
        return sum(batch.nbytes for batch in batches), found
