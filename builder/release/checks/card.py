"""The header of a release's card against its record."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import yaml
from datasets import Features
from datasets.info import DatasetInfosDict
from huggingface_hub import DatasetCardData

from mpmworlds.builder.release.checks.findings import FETCH, Finding
from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import CARD, CONTENT, Record
from mpmworlds.files.text import read_text

_FENCE: Final = "---\n"
_LONGEST: Final = 1 << 20  # characters of a header


def card_findings(root: Path, record: Record | None) -> Iterator[Finding]:
    """Say where the header of the card, which `load_dataset` reads, is wrong."""
    try:
        header = _header(root / CARD)
    except (OSError, ValueError) as error:
        yield Finding(CARD, str(error).removeprefix(f"{root / CARD}: "))
        return
    if record is None:
        return
    infos = _by_name(header.get("dataset_info"))
    configs = _by_name(header.get("configs"))
    for place, found in (("dataset_info", infos), ("configs", configs)):
        for name in sorted(found.keys() ^ record.configs.keys()):
            where = "the card" if name in found else "the record"
            yield Finding(CARD, f"{place}: {name!r} is only in {where}")
    for name in record.configs:
        if name in infos:
            yield from _info_findings(name, infos[name], record)
        if name in configs:
            yield from _config_findings(name, configs[name], record)


def _header(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise ValueError("is missing")
    text = read_text(path)
    _, fence, rest = text.partition(_FENCE)
    header, closing, _ = rest.partition(f"\n{_FENCE}")
    if not text.startswith(_FENCE) or not fence or not closing:
        raise ValueError("has no header of YAML between lines of three dashes")
    if len(header) > _LONGEST:
        raise ValueError(f"its header has more than {_LONGEST} characters")
    try:
        data: Any = yaml.safe_load(header)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f"its header is no YAML ({error})") from None
    if not isinstance(data, dict):
        raise ValueError("its header is no mapping")
    return data


def _by_name(entries: Any) -> dict[str, dict[str, Any]]:
    """Entries of a list by their ``config_name``; those that have none are left out."""
    found = {}
    for entry in entries if isinstance(entries, list) else [entries]:
        if isinstance(entry, dict) and isinstance(entry.get("config_name"), str):
            found[entry["config_name"]] = entry
    return found


def _info_findings(
    name: str, info: dict[str, Any], record: Record
) -> Iterator[Finding]:
    if _features(name, info) != features_of(name):
        yield Finding(CARD, f"{name}: its features are not the columns of {name}")
    rows: Counter[str] = Counter()
    sizes: Counter[str] = Counter()
    for file in record.configs[name].files:
        rows[file.split] += file.rows
        sizes[file.split] += file.num_bytes
    splits = info.get("splits")
    said: dict[str, dict[str, Any]] = {
        str(split["name"]): split
        for split in (splits if isinstance(splits, list) else ())
        if isinstance(split, dict) and isinstance(split.get("name"), str)
    }
    for split in sorted(said.keys() | rows.keys()):
        for key, counted in (("num_examples", rows), ("num_bytes", sizes)):
            here = said.get(split, {}).get(key)
            if here != counted[split]:
                yield Finding(
                    CARD,
                    f"{name}/{split}: {key} is {here!r}, the record says "
                    f"{counted[split]}",
                )


def _features(name: str, info: dict[str, Any]) -> Features | None:
    """Columns that the card tells; None if it tells none that can be understood."""
    card = DatasetCardData(dataset_info=[info])
    try:
        found: DatasetInfosDict = DatasetInfosDict.from_dataset_card_data(card)
    except (ValueError, TypeError, LookupError, AttributeError):
        return None
    return found[name].features if name in found else None


def _config_findings(
    name: str, config: dict[str, Any], record: Record
) -> Iterator[Finding]:
    splits = dict.fromkeys(file.split for file in record.configs[name].files)
    expected = {
        "version": record.version,
        "description": f"{CONTENT}{record.digest(name)}",
        "data_files": [
            {"split": split, "path": f"data/{name}/{split}-*.arrow"} for split in splits
        ],
        "default": True if name == record.default else None,
    }
    for key, value in expected.items():
        if (found := config.get(key)) != value:
            yield Finding(
                CARD,
                f"{name}: {key} is {found!r}, must be {value!r}",
                f"`load_dataset` would be misled; {FETCH}",
            )
