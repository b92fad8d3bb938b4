"""The parameters of corpora: ``params.yaml``, of the package or of one's own."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import yaml

from mpmworlds.builder.plan.evaluation import (
    Measured,
    passed_over,
    read_measured,
    recorded_measured,
)
from mpmworlds.builder.plan.profile import Profile, sample_ids
from mpmworlds.builder.release.layout import CLIPS, PREVIEW
from mpmworlds.files.text import read_text
from mpmworlds.splits.assign import SPLITS
from mpmworlds.splits.lists import EVALUATION, ListParams, compute_lists

EVALUATED: Final = "evaluation"  # configuration of the samples to evaluate on
SHOWN: Final = "mini"  # subset whose samples the configuration of previews has


@dataclass(frozen=True)
class Parameters:
    """What is in a file of parameters.

    Attributes
    ----------
    data
        The file, with the mapping ``profiles``.
    path
        Where it was read from; None for the one that comes with the package.
    measured
        Table of what full runs of evaluation samples showed; that of the package by
        default, if the parameters are its own.
    """

    data: dict[str, Any]
    path: Path | None = None
    measured: Path | None = None
    _ids: dict[str, list[str]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    """Profile -> its ids, once they were asked for."""
    _drawn: dict[str, tuple[list[str], dict[str, list[str]]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    """Profile -> ids, and their lists, once they were asked for: it takes seconds."""

    @classmethod
    def read(
        cls, path: Path | None = None, measured: Path | None = None
    ) -> "Parameters":
        """Read a file, or the one that comes with the package.

        Raises
        ------
        ValueError
            If it is no such file.
        """
        place = path or Path(str(files("mpmworlds").joinpath("params.yaml")))
        try:
            data: Any = yaml.safe_load(read_text(place))
        except yaml.YAMLError as error:
            raise ValueError(f"{place}: is not YAML ({error})") from None
        profiles = data.get("profiles") if isinstance(data, dict) else None
        if isinstance(profiles, dict):
            if all(isinstance(profile, dict) for profile in profiles.values()):
                return cls(data, path, measured)
        raise ValueError(
            f"{place}: must be a mapping with the key 'profiles', a mapping of names "
            "to mappings"
        )

    @property
    def version(self) -> str:
        """Version of the data."""
        return str(self._setting(self.data, "version", str))

    @property
    def root_seed(self) -> int:
        """Seed of every random choice."""
        return int(self._setting(self.data, "root_seed", int))

    def rows_per_shard(self, config: str) -> int:
        """Most rows in a file of a profile."""
        where = f"profile {config!r}: "
        profile = self.data["profiles"][config]
        return int(self._setting(profile, "rows_per_shard", int, where))

    def profile(self, config: str) -> Profile:
        """What to plan.

        Raises
        ------
        ValueError
            If there is no such profile, it is wrong, or the name of a subset.
        """
        self.refuse_subset(config)
        return Profile.from_params(self.data, config)

    def refuse_subset(self, config: str) -> None:
        """Refuse the name of a subset, where a profile is meant."""
        if whole := self.whole_of(config):
            raise ValueError(
                f"--config {config}: is a subset of {whole!r}, which this verb takes "
                f"as a whole; say --config {whole}"
            )

    def whole_of(self, config: str) -> str | None:
        """Name of the profile that has a subset of this name, or None."""
        if config in self.data["profiles"]:
            return None
        for name in sorted(self.data["profiles"]):
            if config in self._subsets(name):
                return str(name)
        return None

    def _subsets(self, profile: str) -> list[str]:
        """Names of the parts of a profile that can be built by themselves."""
        lists = ListParams.from_params(self.data, profile)
        if lists is None:
            return []
        return [
            *lists.subsets,
            EVALUATED,
            *([PREVIEW] if SHOWN in lists.subsets else []),
        ]

    def configurations(self) -> list[str]:
        """Names of all that can be built, without the twins that have no videos."""
        return [
            config
            for name in sorted(self.data["profiles"])
            for config in (name, *self._subsets(name))
        ]

    def refuse_unknown(self, config: str) -> None:
        """Refuse the name of a configuration that cannot be built."""
        name, there = config.removesuffix(CLIPS), self.configurations()
        if name not in there:
            told = f"{config!r}: {name!r}" if name != config else repr(config)
            raise ValueError(
                f"configuration {told} is not in params.yaml; it has "
                f"{', '.join(there) or 'none'}, and each with {CLIPS} behind its name, "
                "without full videos"
            )

    def list_params(self, config: str) -> ListParams:
        """What the lists of a profile are; raises `ValueError` if it has none."""
        found = ListParams.from_params(self.data, config)
        if found is None:
            raise ValueError(f"profile {config!r} has no lists to fill")
        return found

    def lists_of(self, config: str, ids: Iterable[str]) -> dict[str, list[str]]:
        """Splits, evaluation lists and subsets of the ids of a profile."""
        known = sorted(ids)
        if config not in self._drawn or self._drawn[config][0] != known:
            split = Profile.from_params(self.data, config).split
            params = ListParams.from_params(self.data, config)
            passed = passed_over(self.measured_of(config))
            self._drawn[config] = known, compute_lists(known, split, params, passed)
        return dict(self._drawn[config][1])

    def subset(self, config: str) -> tuple[str, set[str] | None]:
        """Profile and ids of a configuration of a release; None for all ids.

        The name of a configuration with ``-clips`` behind it names its twin without
        full videos, ``evaluation`` the samples to evaluate on, and ``preview`` those
        of the subset ``mini``.

        Raises
        ------
        ValueError
            If it is the twin of none.
        """
        name = config.removesuffix(CLIPS)
        whole = self.whole_of(name)
        if whole is None:
            if name != config:
                self.refuse_unknown(config)
            return name, None
        chosen = self.lists_of(whole, self.sample_ids(whole))
        if name == EVALUATED:
            parts = list(EVALUATION.values())
        else:
            subset = SHOWN if name == PREVIEW else name
            parts = [f"{subset}_{split}" for split in SPLITS]
        return whole, {sample for part in parts for sample in chosen[part]}

    def sample_ids(self, profile: str) -> list[str]:
        """Ids of a profile, sorted."""
        if profile not in self._ids:
            self._ids[profile] = sample_ids(Profile.from_params(self.data, profile))
        return list(self._ids[profile])

    def measured_of(self, config: str) -> list[Measured]:
        """What full runs of the evaluation samples of a profile showed."""
        if self.measured:
            return read_measured(self.measured)
        return [] if self.path else recorded_measured(config)

    @staticmethod
    def _setting(data: dict[str, Any], name: str, kind: type, where: str = "") -> Any:
        value = data.get(name)
        if not isinstance(value, kind):
            raise ValueError(
                f"params.yaml: {where}{name} = {value!r}, must be of type "
                f"{kind.__name__}"
            )
        return value
