"""Examples of a release: what a model is shown, and what it is to predict."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, overload

import datasets

from mpmworlds.builder.release.layout import read_record
from mpmworlds.loaders.clips import CLIP, VIDEO, Clip, Stills, clip_of, sampled
from mpmworlds.loaders.locate import (
    HUB_REPOSITORY,
    NAME,
    check_place,
    is_release,
    resolve,
)
from mpmworlds.loaders.mapped import chosen_config, mapped
from mpmworlds.loaders.missing import ROWS
from mpmworlds.loaders.places import find_rows
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
    of
        Configuration and split that they are from, such as ``tiny/test``, for readers.
    """

    def __init__(
        self, table: datasets.Dataset, regime: str = DEFAULT, of: str = ""
    ) -> None:
        self.table = table
        self.regime = regime_named(regime)
        self.of = of

    def __repr__(self) -> str:
        number = f"{len(self)} sample{'s' * (len(self) != 1)}"
        return f"<Examples: {number}{_told(self.of, self.regime)}>"

    def __len__(self) -> int:
        return len(self.table)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            chosen = self.table.select(range(len(self))[index])
            return Examples(chosen, self.regime.name, self.of)
        return example_of(self.table[index], self.regime)

    def __iter__(self) -> Iterator[Example]:
        return (self[index] for index in range(len(self)))


class ExampleStream:
    """The examples of a stream, one after another.

    Parameters
    ----------
    rows
        A stream of ``datasets``.
    regime
        What is told of the scenes.
    of
        Configuration and split that they are from, such as ``tiny/test``, for readers.
    """

    def __init__(
        self, rows: datasets.IterableDataset, regime: Regime, of: str = ""
    ) -> None:
        self.rows = rows
        self.regime = regime
        self.of = of

    def __repr__(self) -> str:
        return f"<ExampleStream: samples{_told(self.of, self.regime)}>"

    def __iter__(self) -> Iterator[Example]:
        return (example_of(row, self.regime) for row in self.rows)

    def take(self, n: int) -> "ExampleStream":
        """The first n of them."""
        return ExampleStream(self.rows.take(n), self.regime, self.of)

    def skip(self, n: int) -> "ExampleStream":
        """Those after the first n."""
        return ExampleStream(self.rows.skip(n), self.regime, self.of)


def _told(of: str, regime: Regime) -> str:
    return f"{' of ' * bool(of)}{of}, regime {regime.name}"


@overload
def load(
    name_or_dir: str | Path = ...,
    split: str | None = ...,
    config: str | None = ...,
    regime: str = ...,
    *,
    ids: Sequence[str] | None = ...,
    revision: str | None = ...,
    streaming: Literal[False] = ...,
) -> Examples: ...


@overload
def load(
    name_or_dir: str | Path = ...,
    split: str | None = ...,
    config: str | None = ...,
    regime: str = ...,
    *,
    ids: Sequence[str] | None = ...,
    revision: str | None = ...,
    streaming: Literal[True],
) -> ExampleStream: ...


def load(
    name_or_dir: str | Path = "tiny",
    split: str | None = "test",
    config: str | None = None,
    regime: str = DEFAULT,
    *,
    ids: Sequence[str] | None = None,
    revision: str | None = None,
    streaming: bool = False,
) -> "Examples | ExampleStream":
    """Load examples.

    A local release is mapped into memory, not copied into the cache of ``datasets``.
    Nothing that is not as it was built is given: files of a folder are hashed once,
    and whenever they have changed; what comes from the Hub is hashed as it is read.

    Parameters
    ----------
    name_or_dir
        Name of a configuration of the release that ``load_dataset("mpmworlds")`` finds,
        or a release itself: its folder (a `Path`, or a text with a separator or a
        leading dot), or a repository on the Hub such as ``"mpmworlds/mpmworlds"``.
    split
        As for ``load_dataset``: ``train``, ``modification_validation`` or ``test``,
        parts such as ``"test[:10]"`` and ``"train[:5%]"``, and sums, ``"train+test"``.
    config
        Configuration of a release that is named; its default one if left out.
    regime
        What is told of the scenes besides their prefixes, a key of
        `mpmworlds.loaders.regimes.REGIMES`: nothing, unless another one is named.
    ids
        Only these samples, of whatever split, without reading any others. Where several
        corpora of a release have an id and no configuration is named, that of `full` is
        meant, if it is there with videos.
    revision
        Version of a repository on the Hub.
    streaming
        Read on from one example to the next, for releases that are not here.

    Returns
    -------
    Examples, or ExampleStream if `streaming`
        Decoded one by one when they are asked for.

    Raises
    ------
    ValueError
        If the release has no such configuration, split or sample, both arguments name a
        configuration, or there is no such regime.
    ReleaseNotFoundError
        If there is no release.
    ChecksumError
        If something is not as it was built.
    """
    place, name = _place_of(name_or_dir, config, revision)
    told = regime_named(regime)
    if place == HUB_REPOSITORY and not revision and ids is None:
        place = NAME  # says what can be done if there is no Hub
    if ids is not None:
        chosen = find_rows(place, ids, name, revision)
        return Examples(chosen.rows, regime, chosen.config)
    local = is_release(Path(place)) and not revision
    if name is None and split is not None:
        _refuse_config(place, split, local)
    if streaming:
        rows = datasets.load_dataset(
            place, name, split=split, revision=revision, streaming=True
        )
        return ExampleStream(rows, told, f"{rows.info.config_name}/{split or 'all'}")
    if split is None:
        raise ValueError("split = None, must be one; or name ids")
    if local:
        name = chosen_config(read_record(Path(place)), name, Path(place))
        return Examples(mapped(Path(place), name, split), regime, f"{name}/{split}")
    found = datasets.load_dataset(place, name, split=split, revision=revision)
    return Examples(found, regime, f"{found.info.config_name}/{split}")


def _refuse_config(place: str, split: str, local: bool) -> None:
    """Say what comes second, where the name of a configuration does."""
    if split in (read_record(Path(place)).configs if local else ROWS):
        raise ValueError(
            f"split = {split!r}: is the name of a configuration; the second argument "
            f"is the split, the third one the configuration, unlike load_dataset: "
            f"load({place!r}, split='test', config={split!r})"
        )


def _place_of(
    name_or_dir: str | Path, config: str | None, revision: str | None
) -> tuple[str, str | None]:
    """Folder or repository of a release, and the configuration that is named."""
    text = str(name_or_dir)
    if isinstance(name_or_dir, Path) and not is_release(name_or_dir):
        text = str(name_or_dir.absolute())
    check_place(text)
    if "/" in text or is_release(Path(text)):
        return text, config
    if config is not None:
        raise ValueError(
            f"{text}: is no release, so config = {config!r} cannot be one "
            "of its; name the folder of a release, or the configuration alone"
        )
    return resolve(revision), text


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
