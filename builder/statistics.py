"""What a manifest holds, in numbers."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, median

from mpmworlds.builder.manifest import KINDS, ManifestRow


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
    materials, object_types
        Scenes that have each, most frequent first.
    """

    scenes: int
    families: int
    kinds: dict[str, int]
    splits: dict[str, int]
    median_objects: float
    mean_objects: float
    two_materials: float
    three_materials: float
    materials: dict[str, int]
    object_types: dict[str, int]


def count_scenes(rows: Sequence[ManifestRow]) -> Statistics:
    """Count the scenes of a manifest.

    Parameters
    ----------
    rows
        The manifest, at least one row.

    Raises
    ------
    ValueError
        If there is no row.
    """
    if not rows:
        raise ValueError("the manifest has no rows, must have at least one to count")
    kinds = Counter(row.kind for row in rows)
    return Statistics(
        scenes=len(rows),
        families=len({row.family_id for row in rows}),
        kinds={kind: kinds[kind] for kind in KINDS},
        splits=_ranked(row.split for row in rows),
        median_objects=float(median(row.num_objects for row in rows)),
        mean_objects=fmean(row.num_objects for row in rows),
        two_materials=fmean(row.num_materials >= 2 for row in rows),
        three_materials=fmean(row.num_materials >= 3 for row in rows),
        materials=_ranked(name for row in rows for name in row.materials),
        object_types=_ranked(name for row in rows for name in row.object_types),
    )


def _ranked(names: Iterable[str]) -> dict[str, int]:
    counts = Counter(names)
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))
