"""Releases as ``datasets`` wants them: which builder, which configurations and files.

For a folder this is read off ``release.json``: a release of which some configurations
were not downloaded is as good as a whole one, for those that are there.
"""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import datasets
from datasets.data_files import DataFilesDict, DataFilesList
from datasets.info import DatasetInfosDict
from datasets.load import BuilderConfigsParameters, DatasetModule
from datasets.packaged_modules.arrow.arrow import ArrowConfig
from datasets.utils.metadata import MetadataConfigs
from huggingface_hub import DatasetCard

from mpmworlds.builder.release.layout import CARD, CONTENT, Record, read_record
from mpmworlds.files.checksums import CHECKSUMS
from mpmworlds.loaders import locate, missing
from mpmworlds.loaders.locate import NAME

_CACHE: Final = ".cache.cache"  # module of what was loaded before
BUILDER: Final = "mpmworlds.loaders.checked"


def module_of(
    original: Callable[..., DatasetModule], path: str, *args: Any, **kwargs: Any
) -> DatasetModule:
    """Find a dataset as `datasets` does, and check it if it is a release.

    Parameters
    ----------
    original
        The function of ``datasets`` that turns a path into a dataset.
    path
        Folder or repository; ``mpmworlds`` stands for what `locate.resolve` finds.
    args, kwargs
        What else the function takes.

    Raises
    ------
    ReleaseNotFoundError
        If the bare name finds nothing here, and no Hub can be reached.
    """
    bare = str(path) == NAME
    if bare:
        path = locate.resolve(kwargs.get("revision"))
    chosen_files = kwargs.get("data_files") or kwargs.get("data_dir")
    if locate.is_release(Path(path)) and not chosen_files:
        return module_of_folder(Path(path))
    of_hub = bare and path == locate.HUB_REPOSITORY and not kwargs.get("revision")
    if of_hub and (reason := locate.why_no_hub()):
        return _had_before(reason)
    try:
        found = original(path, *args, **kwargs)
        if not bare or not found.module_path.endswith(_CACHE):
            return module_of_hub(found)
        reason = "it cannot be reached"
    except (ConnectionError, FileNotFoundError) as error:
        if not bare or kwargs.get("revision"):
            raise
        reason = str(error).partition("\n")[0]
    return _had_before(reason)


def _had_before(reason: str) -> DatasetModule:
    """What was downloaded before; raises `ReleaseNotFoundError` if that is nothing.

    What `datasets` has in its cache may be of any folder of that name.
    """
    if snapshot := locate.snapshot():
        return module_of_folder(snapshot)
    raise locate.ReleaseNotFoundError(missing.no_release(reason))


def module_of_folder(root: Path) -> DatasetModule:
    """How ``datasets`` loads the release in a folder."""
    root = root.absolute()
    record = read_record(root)
    card = DatasetCard.load(root / CARD)
    sums = (root / CHECKSUMS).read_bytes()
    return DatasetModule(
        BUILDER,
        hash=hashlib.sha256(sums + record.text().encode()).hexdigest()[:16],
        builder_kwargs={"base_path": str(root), "dataset_name": "mpmworlds"},
        dataset_infos=DatasetInfosDict.from_dataset_card_data(card.data),
        builder_configs_parameters=BuilderConfigsParameters(
            metadata_configs=MetadataConfigs.from_dataset_card_data(card.data),
            builder_configs=[_config(root, record, name) for name in record.configs],
            default_config_name=record.default,
        ),
    )


def module_of_hub(found: DatasetModule) -> DatasetModule:
    """What ``datasets`` found on the Hub, checked if it is a release of ours."""
    configs = found.builder_configs_parameters.builder_configs or []
    if not configs or not all(map(_is_ours, configs)):
        return found
    # Another key than without a check: what was loaded without it is not served.
    return replace(found, module_path=BUILDER, hash=f"{found.hash}-checked")


def _is_ours(config: Any) -> bool:
    return str(getattr(config, "description", None) or "").startswith(CONTENT)


def _config(root: Path, record: Record, name: str) -> datasets.BuilderConfig:
    files: dict[str, list[str]] = {}
    for file in record.configs[name].files:
        if (root / file.path).is_file():  # else the builder says what is missing
            files.setdefault(file.split, []).append(str(root / file.path))
    return ArrowConfig(
        name=name,
        version=record.version,
        description=f"{CONTENT}{record.digest(name)}",
        data_files=DataFilesDict(
            {split: DataFilesList(paths, []) for split, paths in files.items()}
        ),
    )
