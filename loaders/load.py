"""Examples of a release: what a model is shown, and what it is to predict."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import datasets
from datasets.utils.metadata import MetadataConfigs
from huggingface_hub import DatasetCard

from mpmworlds.files.checksums import read_checksums
from mpmworlds.loaders.clips import CLIP, VIDEO, Clip, Stills, clip_of, sampled
from mpmworlds.loaders.integrity import check_release
from mpmworlds.loaders.locate import is_release, resolve
from mpmworlds.loaders.regimes import DEFAULT, REGIMES, Regime, regime_named
from mpmworlds.metrics.reduction import Frames, split_clip
from mpmworlds.sim.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Example:
    """A sample as it is evaluated.

    Attributes
    ----------
    id
        Id of the sample.
    prefix, continuation
        uint8 (T, N, N, 3), RGB: the frames with t <= 2.5 s, and the others.
    framerate
        Frames per second of both [1/s].
    row
        The other columns of the release: scene, program, lineage, hashes.
    regime
        What is told of the scene.
    """

    id: str
    prefix: Frames
    continuation: Frames
    framerate: int
    row: dict[str, Any]
    regime: Regime = REGIMES[DEFAULT]

    @property
    def side_info(self) -> str:
        """Text that the regime tells of the scene; empty if it tells nothing."""
        return side_info_of(self.row, self.regime)

    def sampled_prefix(self, n: int) -> Stills:
        """Pick n frames of the prefix with their times; see `clips.sampled`."""
        return sampled(Clip(self.prefix, self.framerate), n)


class Examples(Sequence[Example]):
    """The examples of a split, decoded one by one when they are asked for.

    Parameters
    ----------
    table
        Rows of a release with the columns of ``mpmworlds.builder.release.features``.
    regime
        Name of what is told of the scenes.
    """

    def __init__(self, table: datasets.Dataset, regime: str = DEFAULT) -> None:
        self.table = table
        self.regime = regime_named(regime)

    def __len__(self) -> int:
        return len(self.table)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            chosen = self.table.select(range(len(self))[index])
            return Examples(chosen, self.regime.name)
        return example_of(self.table[index], self.regime)

    def __iter__(self) -> Iterator[Example]:
        return (self[index] for index in range(len(self)))


def load(
    name_or_dir: str | Path = "tiny",
    split: str = "test",
    config: str | None = None,
    regime: str = DEFAULT,
) -> Examples:
    """Load the examples of a split.

    A local release is mapped into memory, not copied into the cache of ``datasets``,
    and the files that are used are checked against SHA256SUMS.

    Parameters
    ----------
    name_or_dir
        Name of a configuration of the release that ``load_dataset("mpmworlds")`` finds,
        or the folder of a release.
    split
        ``train``, ``modification_validation`` or ``test``.
    config
        Configuration, when a folder is named; its default one if left out.
    regime
        What is told of the scenes besides their prefixes, a key of
        `mpmworlds.loaders.regimes.REGIMES`: nothing, unless another one is named.

    Returns
    -------
    sequence of Example
        Decoded one by one when they are asked for.

    Raises
    ------
    ValueError
        If the release has no such configuration or split, both arguments name a
        configuration, or there is no such regime.
    ChecksumError
        If a file of a local release is damaged.
    """
    if is_release(Path(name_or_dir)):
        return Examples(_map(Path(name_or_dir), config, split), regime)
    if config is not None:
        raise ValueError(
            f"{name_or_dir}: is no release, so config = {config!r} cannot be one "
            "of its; name the folder of a release, or the configuration alone"
        )
    place = resolve()
    if is_release(Path(place)):
        return Examples(_map(Path(place), str(name_or_dir), split), regime)
    found = datasets.load_dataset(place, str(name_or_dir), split=split)
    return Examples(found, regime)


def _map(root: Path, config: str | None, split: str) -> datasets.Dataset:
    chosen = config or _default_config(root)
    start = f"data/{chosen}/{split}-"
    names = [name for name in sorted(read_checksums(root)) if name.startswith(start)]
    if not names:
        splits = sorted(
            f"{Path(name).parent.name}/{Path(name).name.partition('-')[0]}"
            for name in read_checksums(root)
            if name.endswith(f"-00000-of-{name[-11:-6]}.arrow")
        )
        raise ValueError(
            f"{root}: has no split {chosen}/{split}; it has {', '.join(splits)}"
        )
    check_release(root, names)
    parts = [datasets.Dataset.from_file(str(root / name)) for name in names]
    return datasets.concatenate_datasets(parts)


def _default_config(root: Path) -> str:
    card = DatasetCard.load(root / "README.md")
    name = MetadataConfigs.from_dataset_card_data(card.data).get_default_config_name()
    if name is None:
        raise ValueError(f"{root}/README.md: names no default configuration; name one")
    return str(name)


def neutral_name(sample_id: str) -> str:
    """Name of a sample that says nothing of it, not even its lineage."""
    return hashlib.sha256(f"task of {sample_id}".encode()).hexdigest()[:16]


def side_info_of(row: Mapping[str, Any], regime: Regime) -> str:
    """Text that a regime tells of the scene of a row; empty if it tells nothing."""
    if regime.blind:
        return ""
    return regime.tell(Scene.from_yaml(row["scene"], row["id"]))


def example_of(row: dict[str, Any], regime: Regime = REGIMES[DEFAULT]) -> Example:
    """The example that a row of a release is.

    Parameters
    ----------
    row
        Its columns, the bytes of the video among them.
    regime
        What is told of the scene.

    Raises
    ------
    ValueError
        If it has no video, or one that cannot be cut in two.
    """
    clip = clip_of(row)
    try:
        prefix, continuation = split_clip(*clip)
    except ValueError as error:
        raise ValueError(f"{row['id']}: {error}") from None
    others = {name: row[name] for name in row if name not in (CLIP, VIDEO)}
    return Example(row["id"], prefix, continuation, clip.framerate, others, regime)
