"""The ``datasets`` builder of a release: schema, files, examples, nothing else."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import datasets
import pyarrow as pa
from datasets.table import cast_array_to_feature

from mpmworlds.builder.plan.manifest import ManifestRow
from mpmworlds.builder.release.features import recipe_features, release_features
from mpmworlds.builder.render.store import Store

# Rows a record batch: what `datasets` itself takes for videos. Small, because a batch
# is held in memory and is the least that a reader fetches.
BATCH_ROWS: Final = 10

Shard = tuple[ManifestRow, ...]


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
        Folder of the rendered samples; None builds rows without program and video.
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
        rendered = self.config.store is not None
        return datasets.DatasetInfo(
            features=release_features() if rendered else recipe_features(),
            license="cc-by-4.0",
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
            for row in shard:
                yield row.id, self._example(row)

    def _example(self, row: ManifestRow) -> dict[str, Any]:
        recipe = asdict(row)
        if self.config.store is None:
            return recipe
        sample = Store(self.config.store).get(row.program_sha256)
        if sample is None:
            raise NotRenderedError(
                f"{row.id}: its video is not in the store {self.config.store}, or is "
                "corrupt there; materialise the manifest again"
            )
        return recipe | {
            "program": sample.program,
            "video": {"bytes": sample.video, "path": f"{row.id}.mp4"},
            "frames_sha256": sample.description.frames_sha256,
            "num_frames": sample.description.num_frames,
            "framerate": sample.description.framerate,
            "resolution": sample.description.resolution,
        }

    def write_shard(self, shard: Shard, path: Path) -> tuple[int, int]:
        """Write the rows of one shard as an Arrow IPC stream.

        The bytes are those of ``datasets.arrow_writer.ArrowWriter``; writing them here
        spares each process the import of torch that encoding a video feature may bring.

        Parameters
        ----------
        shard
            The rows.
        path
            File to write.

        Returns
        -------
        tuple of int
            Number of rows, and of bytes in memory.

        Raises
        ------
        NotRenderedError
            If the store lacks a row's video.
        """
        schema = self.info.features.arrow_schema
        size = 0
        with (
            pa.OSFile(str(path), "wb") as file,
            pa.ipc.new_stream(file, schema) as writer,
        ):
            for start in range(0, len(shard), BATCH_ROWS):
                examples = self._generate_examples([shard[start : start + BATCH_ROWS]])
                batch = pa.RecordBatch.from_pylist(
                    [example for _, example in examples], schema=schema
                )
                batch = self._as_datasets_has_it(batch)
                writer.write_batch(batch)
                size += batch.nbytes
        return len(shard), size

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
            count, num_bytes = self.write_shard(shard, Path(path + ".part"))
            os.replace(path + ".part", path)
            rows.append(count)
            size += num_bytes
            yield job_id, False, count
        features, files = self.info.features, len(rows)
        yield job_id, True, (sum(rows), size, features, files, rows, files, list(rows))
