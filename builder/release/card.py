"""The README of a release: YAML header, ``dataset_card.md``, fields and statistics.

The header is what makes ``load_dataset`` work: without it the library guesses splits
from file names and takes ``modification_validation`` for ``validation``.
"""

import inspect
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any, Final

import pyarrow as pa
from datasets import DatasetInfo, SplitDict, SplitInfo
from datasets.info import DatasetInfosDict
from datasets.utils.metadata import MetadataConfigs
from huggingface_hub import DatasetCardData

from mpmworlds.builder.release import croissant
from mpmworlds.builder.release.features import (
    PREVIEW_COLUMNS,
    RECIPE_COLUMNS,
    RENDERED_COLUMNS,
    columns_of,
    features_of,
)
from mpmworlds.builder.release.layout import CONTENT, Record
from mpmworlds.builder.statistics.counts import count_table
from mpmworlds.sim.scene.objects import MATERIALS
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.lists import EVALUATION

FIELDS_MARK: Final = "<!-- fields -->"
MATERIALS_MARK: Final = "<!-- materials -->"
STATISTICS_MARK: Final = "<!-- statistics -->"
LISTS_MARK: Final = "<!-- lists -->"
CONFIG_MARK: Final = "<config>"
SPLIT_MARK: Final = "<split>"
VERSION_MARK: Final = "<version>"

_SIZE_CATEGORIES: Final = (
    (1_000, "n<1K"),
    (10_000, "1K<n<10K"),
    (100_000, "10K<n<100K"),
    (1_000_000, "100K<n<1M"),
)
_TAGS: Final = [
    "arxiv:2606.01538",
    "physics",
    "simulation",
    "material-point-method",
    "video-prediction",
    "program-synthesis",
]


@dataclass
class ConfigSize:
    """How large a configuration is.

    Attributes
    ----------
    name
        Name of the configuration.
    rows, num_bytes
        Per split: number of rows, and of bytes in memory.
    file_size
        Bytes of all its files.
    """

    name: str
    rows: Counter[str] = field(default_factory=Counter)
    num_bytes: Counter[str] = field(default_factory=Counter)
    file_size: int = 0

    def add(self, split: str, rows: int, num_bytes: int, file_size: int) -> None:
        """Count one more shard."""
        self.rows[split] += rows
        self.num_bytes[split] += num_bytes
        self.file_size += file_size


def card_text(
    rows: pa.Table,
    sizes: Sequence[ConfigSize],
    record: Record,
    lists: Mapping[str, Collection[str]],
) -> str:
    """Return the README of a release.

    Parameters
    ----------
    rows
        All rows of the corpus.
    sizes
        The configurations, the default one first.
    record
        What the release consists of.
    lists
        Name -> ids of the lists that are published beside those of the splits.
    """
    body = files("mpmworlds").joinpath("dataset_card.md").read_text(encoding="utf-8")
    body = body.replace(FIELDS_MARK, fields_table())
    body = body.replace(MATERIALS_MARK, materials_table())
    body = body.replace(LISTS_MARK, lists_text(lists))
    splits = list(sizes[0].rows)
    body = body.replace(CONFIG_MARK, sizes[0].name)
    body = body.replace(SPLIT_MARK, "test" if "test" in splits else splits[0])
    body = body.replace(VERSION_MARK, record.version)
    body = body.replace(STATISTICS_MARK, statistics_text(rows, sizes, record.version))
    return f"---\n{header(rows, sizes, record)}---\n\n{body}"


def header(rows: pa.Table, sizes: Sequence[ConfigSize], record: Record) -> str:
    """Return the YAML that the Hub and ``load_dataset`` read, without its fences."""
    data = DatasetCardData(
        language="en",
        license="cc-by-4.0",
        pretty_name="MPMWorlds",
        size_categories=next(
            (name for limit, name in _SIZE_CATEGORIES if len(rows) < limit), "n>1M"
        ),
        tags=_TAGS,
        task_categories=["image-to-video", "video-text-to-text"],
    )
    infos = {size.name: _info(size, record.version) for size in sizes}
    DatasetInfosDict(infos).to_dataset_card_data(data)
    _add_about(data)
    configs = {s.name: _config(s, record, s is sizes[0]) for s in sizes}
    MetadataConfigs(configs).to_dataset_card_data(data)
    return f"{data}\n"


def _add_about(data: DatasetCardData) -> None:
    """Add what `Dataset.info` has from the card but is not written into it."""
    about = {
        "description": croissant.DESCRIPTION,
        "citation": croissant.CITATION,
        "homepage": croissant.HOMEPAGE,
        "license": croissant.LICENCE,
    }
    told = data["dataset_info"]  # a mapping, where there is one configuration
    for info in told if isinstance(told, list) else [told]:
        info |= about


def _config(size: ConfigSize, record: Record, is_default: bool) -> dict[str, Any]:
    data_files = [
        {"split": split, "path": f"data/{size.name}/{split}-*.arrow"}
        for split in size.rows
    ]
    default = {"default": True} if is_default else {}
    # With other content the header is another one, and so is the key of the cache in
    # which `datasets` keeps what it has loaded.
    content = f"{CONTENT}{record.digest(size.name)}"
    described = {"version": record.version, "description": content}
    return {**described, "data_files": data_files, **default}


def _info(size: ConfigSize, version: str) -> DatasetInfo:
    splits = SplitDict(dataset_name="mpmworlds")
    for split, count in size.rows.items():
        splits.add(
            SplitInfo(split, num_bytes=size.num_bytes[split], num_examples=count)
        )
    return DatasetInfo(
        features=features_of(size.name),
        splits=splits,
        download_size=size.file_size,
        dataset_size=size.num_bytes.total(),
        version=version,
    )


def fields_table() -> str:
    """Return the columns of a release as a Markdown table."""
    lines = ["| field | type | meaning |", "|---|---|---|"]
    for column in RECIPE_COLUMNS:
        lines.append(
            f"| `{column.name}` | {_type(column.feature)} | {column.meaning} |"
        )
    for mark, columns in (("*", RENDERED_COLUMNS), ("**", PREVIEW_COLUMNS)):
        for column in columns:
            kind = _type(column.feature)
            lines.append(f"| `{column.name}` {mark} | {kind} | {column.meaning} |")
    said = ["\\* not in `recipes` and `preview`", "\\*\\* only in `preview`"]
    return "\n".join([*lines, "", "; ".join(said)])


def _type(feature: Any) -> str:  # features have no common type
    if isinstance(feature, dict):
        kinds = " or ".join(sorted({_type(inner) for inner in feature.values()}))
        return f"{kinds} of each of {', '.join(feature)}"
    inner = getattr(feature, "feature", None)
    if inner is not None:
        return f"list of {inner.dtype}"
    return {"Video": "video", "Image": "image"}.get(feature._type, str(feature.dtype))


def materials_table() -> str:
    """Return the constitutive models and their parameters as a Markdown table."""
    lines = ["| model | what it is | parameters |", "|---|---|---|"]
    for name, material in sorted(MATERIALS.items()):
        meaning = inspect.cleandoc(material.__doc__ or "").partition("\n")[0]
        parameters = ", ".join(
            f"`{parameter}`: {info.description}"
            for parameter, info in material.model_fields.items()
            if parameter != "constitutive_model"
        )
        lines.append(f"| `{name}` | {meaning} | {parameters} |")
    return "\n".join(lines)


_SUBSETS: Final = (
    "The other lists are smaller corpora, one list for each split. Those of the",
    "splits to evaluate on are the first of the fixed samples. Training samples",
    "begin with the seeds and parents of the modifications; the rest is drawn, seeds",
    "and parents with the highest weight and perturbations with the lowest.",
)


def lists_text(lists: Mapping[str, Collection[str]]) -> str:
    """Return what is chosen from the splits, as Markdown; "" for nothing.

    Parameters
    ----------
    lists
        Name -> ids, as `mpmworlds.splits.lists.compute_lists` names them.
    """
    if not lists:
        return ""
    subsets = any(name not in EVALUATION.values() for name in lists)
    table = ["| list | samples | seeds and parents | children | perturbations |"]
    table.append("|---|---|---|---|---|")
    for name, ids in lists.items():
        kinds = Counter(SampleId.parse(sample_id).kind for sample_id in ids)
        roots = kinds["seed"] + kinds["parent"]
        counts = (len(ids), roots, kinds["child"], kinds["perturbation"])
        table.append(f"| `{name}` | {' | '.join(f'{n:,}' for n in counts)} |")
    return "\n".join(
        [
            "Chosen from the splits, by salted SHA-256 as well, are fixed samples to",
            "evaluate on, `evaluation_*`.",
            *(_SUBSETS if subsets else ()),
            "",
            *table,
        ]
    )


def statistics_text(rows: pa.Table, sizes: Iterable[ConfigSize], version: str) -> str:
    """Return what a release holds, as Markdown counted from the manifest."""
    found = count_table(rows)
    listed = ", ".join(f"{n:,} {_PLURAL[kind]}" for kind, n in found.kinds.items())
    intro = f"Data version {version}: {found.scenes:,} scenes of {found.families:,}"
    spread = (
        f"Objects per scene: median {found.median_objects:g}, mean "
        f"{found.mean_objects:.1f}. {found.two_materials:.1%} of the scenes have two "
        f"materials or more, {found.three_materials:.1%} three or more."
    )
    return "\n\n".join(
        [
            f"{intro} families ({listed}).",
            _sizes_table(sizes),
            spread,
            _shares("material", found.materials, found.scenes),
            _shares("object type", found.object_types, found.scenes),
        ]
    )


_PLURAL: Final = {
    "seed": "seeds",
    "parent": "parents",
    "child": "children",
    "perturbation": "perturbations",
}


_LARGE: Final = ("program", "video", "clip", "preview", "poster")


def _sizes_table(sizes: Iterable[ConfigSize]) -> str:
    lines = ["| configuration | has | split | rows | MB |", "|---|---|---|---|---|"]
    for size in sizes:
        names = {column.name for column in columns_of(size.name)}
        has = ", ".join(f"`{part}`" for part in _LARGE if part in names) or "scenes"
        for split, rows in size.rows.items():
            told = f"`{split}` | {rows:,} | {size.num_bytes[split] / 1e6:,.1f}"
            lines.append(f"| `{size.name}` | {has} | {told} |")
    return "\n".join(lines)


def _shares(noun: str, counts: Mapping[str, int], total: int) -> str:
    lines = [f"| {noun} | scenes | share |", "|---|---|---|"]
    for name, scenes in counts.items():
        lines.append(f"| {name} | {scenes:,} | {scenes / total:.1%} |")
    return "\n".join(lines)
