"""Named parts of an evaluation, by what is in the scene."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final

from mpmworlds.baselines.results import Result
from mpmworlds.sim.scene.objects import MATERIALS


def _material_families(result: Result) -> set[str]:
    unknown = set(result.materials) - MATERIALS.keys()
    if unknown:
        raise ValueError(
            f"{result.sample_id}: material {min(unknown)!r}, must be one of "
            f"{sorted(MATERIALS)}; evaluate with the version that built the release"
        )
    return {MATERIALS[material].FAMILY for material in result.materials}


SLICES: Final[Mapping[str, Callable[[Result], Iterable[str]]]] = MappingProxyType(
    {
        "material_family": _material_families,
        "object_type": lambda result: set(result.object_types),
        "num_objects": lambda result: [str(result.num_objects)],
        "num_materials": lambda result: [str(len(result.materials))],
    }
)
"""Slice -> the names of its parts that a sample is in. A sample with several materials
is in the part of each of their families, one with several types of objects in the part
of each of them."""


def parts(results: Iterable[Result]) -> dict[str, dict[str, list[Result]]]:
    """Divide results into the parts of every slice.

    Parameters
    ----------
    results
        Rows of one evaluation.

    Returns
    -------
    dict
        Slice -> part -> its rows in their order; parts in order, numbers by size.
    """
    table: dict[str, dict[str, list[Result]]] = {name: {} for name in SLICES}
    for result in results:
        for name, parts_of in SLICES.items():
            for part in sorted(parts_of(result)):
                table[name].setdefault(part, []).append(result)
    return {
        name: {part: members[part] for part in sorted(members, key=_order)}
        for name, members in table.items()
    }


def _order(part: str) -> tuple[int, str]:
    return (int(part) if part.isdecimal() else -1, part)
