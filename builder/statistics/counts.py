"""What a manifest holds, in numbers, counted on its columns."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mpmworlds.builder.plan.manifest import SCHEMA, ManifestRow, operator_of
from mpmworlds.sim.scene.objects import MATERIALS
from mpmworlds.splits.assign import SPLITS
from mpmworlds.splits.ids import SAMPLE_KINDS
from mpmworlds.splits.scenes import recorded_scene
from mpmworlds.splits.similarity import structure

COUNTED: Final = (
    *("kind", "family_id", "edit", "split", "materials", "object_types"),
    *("num_objects", "num_materials", "scene"),
)
MODEL: Final = re.compile(r"constitutive_model: (\w+)")  # in the text of a scene
STRUCTURED: Final = ("id", "kind", "scene")


@dataclass(frozen=True)
class Statistics:
    """Counts over the scenes of a manifest.

    Attributes
    ----------
    scenes, families
        Number of scenes, and of lineages that they belong to.
    kinds, splits
        Scenes per kind and per split.
    median_objects, mean_objects
        Objects per scene.
    two_materials, three_materials
        Share of scenes with at least two, at least three materials. [1]
    num_objects, num_materials
        Scenes per number of objects, and of distinct materials.
    materials, object_types
        Scenes that have each, most frequent first.
    edits
        Scenes made by each operator, most frequent first.
    matter
        Bodies and emitters of the templates by the family of their material, most
        frequent first.
    """

    scenes: int
    families: int
    kinds: dict[str, int]
    splits: dict[str, int]
    median_objects: float
    mean_objects: float
    two_materials: float
    three_materials: float
    num_objects: dict[int, int]
    num_materials: dict[int, int]
    materials: dict[str, int]
    object_types: dict[str, int]
    edits: dict[str, int]
    matter: dict[str, int]

    def share(self, family: str) -> float:
        """Part of the matter of templates that is of a family of materials."""
        return self.matter.get(family, 0) / max(sum(self.matter.values()), 1)

    @property
    def perturbations(self) -> int:
        """Number of scenes that perturb another."""
        return self.kinds["perturbation"]

    @property
    def templates(self) -> int:
        """Number of all other scenes: parents, their children, and hand-made seeds."""
        return self.scenes - self.perturbations


@dataclass(frozen=True)
class Structures:
    """How varied the parents of a manifest are.

    Attributes
    ----------
    parents
        Number of parents.
    distinct
        Number of distinct structures that they have.
    commonest
        The most frequent one.
    commonest_share
        Share of the parents that have it. [1]
    """

    parents: int
    distinct: int
    commonest: str
    commonest_share: float


def count_scenes(rows: Sequence[ManifestRow]) -> Statistics:
    """Count the scenes of manifest rows; see `count_table`."""
    columns = {name: [getattr(row, name) for row in rows] for name in COUNTED}
    fields = [SCHEMA.field(name) for name in COUNTED]
    return count_table(pa.table(columns, schema=pa.schema(fields)))


def count_table(table: pa.Table) -> Statistics:
    """Count the scenes of a manifest.

    Parameters
    ----------
    table
        The columns `COUNTED` of a manifest, at least one row.

    Returns
    -------
    Statistics
        What it holds.

    Raises
    ------
    ValueError
        If there is no row, or an edit does not name its operator.
    """
    if not len(table):
        raise ValueError("the manifest has no rows, must have at least one to count")
    objects = table["num_objects"].to_numpy()
    materials = table["num_materials"].to_numpy()
    return Statistics(
        scenes=len(table),
        families=len(pc.unique(table["family_id"])),
        kinds=_counts(table["kind"], SAMPLE_KINDS),
        splits=_counts(table["split"], SPLITS),
        median_objects=float(np.median(objects)),
        mean_objects=float(objects.mean()),
        two_materials=float((materials >= 2).mean()),
        three_materials=float((materials >= 3).mean()),
        num_objects=dict(sorted(Counter(objects.tolist()).items())),
        num_materials=dict(sorted(Counter(materials.tolist()).items())),
        materials=_ranked(pc.list_flatten(table["materials"]).to_pylist()),
        object_types=_ranked(pc.list_flatten(table["object_types"]).to_pylist()),
        edits=_ranked(map(operator_of, filter(None, table["edit"].to_pylist()))),
        matter=_ranked(_families(table)),
    )


def count_by_split(table: pa.Table) -> dict[str, Statistics]:
    """Count the scenes of each split that has any; see `count_table`."""
    parts = {split: table.filter(pc.equal(table["split"], split)) for split in SPLITS}
    return {split: count_table(part) for split, part in parts.items() if len(part)}


def count_structures(table: pa.Table) -> Structures:
    """Count the structures of the parents of a manifest.

    Parameters
    ----------
    table
        The columns `STRUCTURED` of a manifest.

    Returns
    -------
    Structures
        Those of its parents; of none, if it has no parents.

    Raises
    ------
    ValueError
        If the scene of a parent cannot be read.
    """
    parents = table.filter(pc.equal(table["kind"], "parent"))
    texts = zip(parents["id"].to_pylist(), parents["scene"].to_pylist(), strict=True)
    found = _ranked(structure(recorded_scene(text, name)) for name, text in texts)
    commonest = next(iter(found), "")
    share = found[commonest] / len(parents) if found else 0.0
    return Structures(len(parents), len(found), commonest, share)


def _families(table: pa.Table) -> Iterator[str]:
    """Family of the material of every body and emitter of the templates."""
    templates = table.filter(pc.not_equal(table["kind"], "perturbation"))
    for text in templates["scene"].to_pylist():
        for name in MODEL.findall(text):
            yield MATERIALS[name].FAMILY


def _counts(column: pa.ChunkedArray, order: Sequence[str]) -> dict[str, int]:
    """Rows per value: the known ones in their order, then others."""
    found = _ranked(column.to_pylist())
    return {name: found.pop(name, 0) for name in order} | found


def _ranked(names: Iterable[str]) -> dict[str, int]:
    counts = Counter(names)
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))
