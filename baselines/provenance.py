"""What results have in common: who predicted what, told what, scored how."""

import hashlib
import inspect
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Self

from mpmworlds.baselines.protocol import AnyPredictor, Oracle
from mpmworlds.builder.release.layout import read_record
from mpmworlds.loaders.mapped import chosen_config
from mpmworlds.loaders.regimes import DEFAULT
from mpmworlds.metrics import VERSION, definition

PACKAGES: Final = ("mpmworlds", "numpy", "opencv-python-headless", "taichi")
IF_LOADED: Final = ("torch", "transformers", "diffusers", "openai", "taichi-forge")
NO_OPTIONS: Final[Mapping[str, Any]] = MappingProxyType({})


@dataclass(frozen=True)
class Provenance:
    """What all rows of a results file have in common."""

    predictor: str
    """Name of the predictor."""
    options: dict[str, Any]
    """What it was made with, and what else it says of its configuration: weights,
    prompts, sampling, seeds."""
    predictor_sha256: str
    """Digest of the name of its class, of its options, and, for a class that is not of
    this package, of the source file of its module where there is one."""
    config: str
    """Configuration of the release, e.g. ``tiny``."""
    split: str
    """Split that the samples are from."""
    regime: str
    """What the predictor was told besides the prefix."""
    selection: str
    """How one of several candidates is chosen, see `baselines.candidates`."""
    knows_answers: bool
    """Whether it is an oracle: what it scores is no prediction."""
    release_sha256: str
    """Digest of the content of the configuration; others of the release may change."""
    metrics_version: str
    """Version of the metric definitions."""
    constants_sha256: str
    """Digest of the constants of the metrics."""
    versions: dict[str, str]
    """Versions of the packages that could matter."""

    @classmethod
    def of(
        cls,
        release: Path,
        predictor: AnyPredictor,
        config: str,
        split: str,
        regime: str = DEFAULT,
        *,
        options: Mapping[str, Any] = NO_OPTIONS,
        selection: str = "prefix",
    ) -> Self:
        """Return the provenance of results that are computed now.

        Parameters
        ----------
        release
            Folder of the release.
        predictor
            What predicts. If it has a mapping ``configuration``, that is part of what
            it is: digests of weights, versions of prompts. If it has names of
            ``packages``, their versions are told.
        config, split, regime, selection
            As in the fields.
        options
            What the predictor was made with.

        Raises
        ------
        FileNotFoundError
            If there is no release.
        """
        told = dict(options) | dict(getattr(predictor, "configuration", NO_OPTIONS))
        kind = type(predictor)
        return cls(
            predictor=predictor.name,
            options=told,
            predictor_sha256=_digest(
                [f"{kind.__module__}:{kind.__qualname__}", told, *_source(kind)]
            ),
            config=config,
            split=split,
            regime=regime,
            selection=selection,
            knows_answers=isinstance(predictor, Oracle),
            release_sha256=release_sha256(release, config),
            metrics_version=VERSION,
            constants_sha256=constants_sha256(),
            versions=_versions(_used_by(predictor)),
        )


def _digest(record: Any) -> str:
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def _is_ours(kind: type) -> bool:
    return kind.__module__.startswith("mpmworlds.")


def _source(kind: type) -> list[str]:
    """Digest of the file that a class is from; none for one of this package.

    What our own classes do is told by the version of the package. A class that was
    typed into an interpreter has no file.
    """
    if _is_ours(kind):
        return []
    try:
        path = inspect.getsourcefile(kind)
        return [hashlib.sha256(Path(path).read_bytes()).hexdigest()] if path else []
    except (OSError, TypeError):
        return []


def _used_by(predictor: AnyPredictor) -> Sequence[str]:
    """Packages that a predictor says it uses, or, if it says nothing, has loaded.

    What else this process has loaded is no property of a predictor of this package.
    """
    loaded = [name for name in IF_LOADED if name.replace("-", "_") in sys.modules]
    return list(
        getattr(predictor, "packages", () if _is_ours(type(predictor)) else loaded)
    )


def _versions(used: Sequence[str]) -> dict[str, str]:
    """Of what is always used, and of what the predictor uses."""
    found = {}
    for name in (*PACKAGES, *used):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


@cache
def processor() -> str:
    """Name of the processor that works here; empty if the system does not tell."""
    try:
        told = Path("/proc/cpuinfo").read_text("utf-8")
    except OSError:
        return ""
    lines = (line.partition(":") for line in told.splitlines())
    return next((value.strip() for key, _, value in lines if "model name" in key), "")


def constants_sha256() -> str:
    """Digest of the constants of the metrics of this version."""
    return _digest(definition())


def release_sha256(release: Path, config: str) -> str:
    """Digest of the content of a configuration of a release.

    Raises
    ------
    FileNotFoundError
        If there is no release.
    ValueError
        If it has no such configuration.
    """
    record = read_record(release)
    return record.digest(chosen_config(record, config, release))
