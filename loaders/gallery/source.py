"""Which samples of a release a gallery shows, and where each of them is."""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Final

import datasets

from mpmworlds.builder.release.features import columns_of
from mpmworlds.builder.release.layout import PREVIEW
from mpmworlds.files.checksums import read_checksums
from mpmworlds.loaders.clips import CLIP, VIDEO
from mpmworlds.loaders.load import load
from mpmworlds.loaders.locate import is_release, resolve
from mpmworlds.splits import SampleId

Row = dict[str, Any]

_SHARD: Final = re.compile(r"data/([^/]+)/(.+)-\d{5}-of-\d{5}\.arrow")
_NAMED_AT_MOST: Final = 3


@dataclass(frozen=True)
class Place:
    """Where a sample is in a release."""

    release: Path
    config: str
    split: str
    index: int

    def row(self) -> Row:
        """All columns of the sample."""
        return dict(_table(self.release, self.config, self.split)[self.index])


class Source:
    """The samples of a release.

    Parameters
    ----------
    release
        Folder of the release.

    Raises
    ------
    FileNotFoundError
        If there is no release.
    """

    def __init__(self, release: Path) -> None:
        for known in (_table, _previews):  # the release may have been built again
            known.cache_clear()
        self.release = release
        self._parts = _parts_of(release)

    @cached_property
    def configs(self) -> list[str]:
        """Configurations that can be looked at: with programs and videos.

        Those with exact videos come first.
        """
        names = sorted({config for config, _ in self._parts})
        columns = {name: self.columns(name) for name in names}
        shown = [n for n in names if {"program", "frames_sha256"} <= columns[n]]
        exact = [n for n in shown if VIDEO in columns[n]]
        return exact + [n for n in shown if n not in exact and CLIP in columns[n]]

    def choose(
        self,
        config: str | None = None,
        split: str | None = None,
        ids: Collection[str] | None = None,
        limit: int | None = None,
    ) -> dict[str, Place]:
        """Choose samples.

        Parameters
        ----------
        config
            A configuration; those of all that can be looked at if left out.
        split
            A split; all of them if left out.
        ids
            Only these.
        limit
            The first ones only.

        Returns
        -------
        dict
            Id -> place, families together: seeds, then parents, each before what is
            made from it.

        Raises
        ------
        ValueError
            If there is no such configuration, split or sample, or none at all.
        """
        if limit is not None and limit < 1:
            raise ValueError(f"limit = {limit}, must be at least 1")
        if config is not None and config not in self.configs:
            raise ValueError(
                f"{self.release}: has no configuration {config!r} with videos and "
                f"programs; it has {_listed(self.configs)}"
            )
        configs = [config] if config else self.configs
        splits = sorted({part for name in configs for part in self._splits(name)})
        if split is not None and split not in splits:
            raise ValueError(
                f"{self.release}: has no split {split!r}; it has {_listed(splits)}"
            )
        places: dict[str, Place] = {}
        for name in configs:
            for sample, place in self.places(name).items():
                if split in (None, place.split):
                    places.setdefault(sample, place)
        if ids is not None:
            self._check_ids(ids, places)
            places = {name: places[name] for name in places if name in ids}
        if not places:
            raise ValueError(
                f"{self.release}: has no sample to show; build a configuration with "
                "videos"
            )
        return {name: places[name] for name in sorted(places, key=_order)[:limit]}

    def places(self, config: str) -> dict[str, Place]:
        """Where each sample of a configuration is."""
        return {
            sample: Place(self.release, config, split, index)
            for split in self._splits(config)
            for index, sample in enumerate(_ids(self.release, config, split))
        }

    def scenes(self, ids: Collection[str]) -> dict[str, str]:
        """Scenes of samples, of those that any configuration has."""
        found: dict[str, str] = {}
        for config, split in self._parts:
            wanted = set(ids) - set(found)
            if not wanted:
                break
            table = _table(self.release, config, split)
            for index, name in enumerate(_ids(self.release, config, split)):
                if name in wanted:
                    found[name] = table.data.column("scene")[index].as_py()
        return found

    def described(self, places: Sequence[Place]) -> Iterator[Row]:
        """Rows at places, without their videos: in a hundredth of the time."""
        for place in places:
            table = _table(self.release, place.config, place.split)
            names = [name for name in table.column_names if name not in (CLIP, VIDEO)]
            columns = table.data
            yield {name: columns.column(name)[place.index].as_py() for name in names}

    def _check_ids(self, ids: Collection[str], places: Collection[str]) -> None:
        unknown = sorted(set(ids) - set(places))
        if unknown:
            more = len(unknown) - _NAMED_AT_MOST
            told = ", ".join(unknown[:_NAMED_AT_MOST])
            told += f" and {more} more" if more > 0 else ""
            raise ValueError(
                f"{self.release}: no video of {told} in {_listed(self.configs)}; leave "
                "them out, or name a release that has them"
            )

    def _splits(self, config: str) -> list[str]:
        return [split for name, split in self._parts if name == config]

    def columns(self, config: str) -> set[str]:
        """Names of the columns of a configuration, which its own name decides."""
        return {column.name for column in columns_of(config)}


def preview_of(release: Path, row: Row) -> Row | None:
    """Row with the preview and the poster of a sample, if a release has them."""
    place = _previews(release).get(row["id"])
    found = place.row() if place else None
    same = found is not None and found["program_sha256"] == row["program_sha256"]
    return found if same else None


@cache
def _previews(release: Path) -> dict[str, Place]:
    return {
        sample: Place(release, config, split, index)
        for config, split in _parts_of(release)
        if config == PREVIEW
        for index, sample in enumerate(_ids(release, config, split))
    }


def _parts_of(release: Path) -> list[tuple[str, str]]:
    """Configurations and splits of a release."""
    found = map(_SHARD.fullmatch, read_checksums(release))
    return sorted({(m[1], m[2]) for m in found if m})


def _ids(release: Path, config: str, split: str) -> list[str]:
    column = _table(release, config, split).data.column("id")
    return [str(name) for name in column.to_pylist()]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"


def _order(name: str) -> tuple[bool, int, str, int, int]:
    """Seeds first; then by numbers, not by letters."""
    sample = SampleId.parse(name)
    child = -1 if sample.child is None else sample.child
    number = -1 if sample.perturbation is None else sample.perturbation
    family = sample.family
    return not sample.is_of_seed_family, len(family), family, child, number


@cache
def _table(release: Path, config: str, split: str) -> datasets.Dataset:
    """A split of a release, loaded once in a process."""
    return load(release, split=split, config=config).table


def find_video(
    sample: str, program_sha256: str, release: Path | None = None
) -> Row | None:
    """Row of a sample in a release on this machine, if that has the same program.

    Parameters
    ----------
    sample
        Its id.
    program_sha256
        SHA-256 of its program: another corpus may have another sample of that id.
    release
        Folder of the release; the one that `mpmworlds` stands for if left out.

    Raises
    ------
    OSError
        If there is no release in the folder.
    """
    folder = release or Path(resolve())
    if release is None and not is_release(folder):
        return None
    source = Source(folder)
    for config in source.configs:
        place = source.places(config).get(sample)
        row = place.row() if place else None
        if row and row["program_sha256"] == program_sha256:
            return row
    return None
