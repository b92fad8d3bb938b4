"""Templates of different splits whose scenes are nearly the same.

Only templates are compared: seeds, parents and children. A perturbation is a small
step from its template and in the same split.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from itertools import combinations
from typing import Final

import numpy as np
from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.audit_records import Finding, Record
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.scenes import recorded_scene
from mpmworlds.splits.similarity import (
    Mask,
    Numbers,
    config_distance,
    covered,
    signature,
    structure,
    view_distance,
)

NEAR: Final = 0.05  # config distance below which a person calls two scenes alike
PIXELS: Final = 64  # at which first frames are compared
ROUNDING: Final = 1e-12
KIN: Final = 0.02  # part of `near` at which a modification has changed next to nothing


class Template:
    """A template with what its scene is compared by, made when it is first needed."""

    def __init__(self, sample: SampleId, split: str, scene: Scene) -> None:
        self.sample, self.split, self.scene = sample, split, scene

    @cached_property
    def numbers(self) -> Numbers:
        """Its signature."""
        return signature(self.scene)

    @cached_property
    def covered(self) -> Mask:
        """What the first-frame distance compares."""
        return covered(self.scene, PIXELS)


def near_findings(
    templates: Iterable[Record], near: float = NEAR
) -> tuple[list[Finding], list[Finding]]:
    """Find templates of different splits that are nearly the same.

    Two are near if they have the same structure and at most `near` of config distance;
    how far apart their first frames are is told, for whoever looks at the pair. A child
    in modification_validation is meant to be near its own family in training; such kin
    are no problem unless they are within the part `KIN` of the limit.

    Parameters
    ----------
    templates
        Samples that are no perturbations, with ids in the grammar.
    near
        Largest config distance of scenes that are near, >= 0. [1]

    Returns
    -------
    problems : list of Finding
        Pairs that must not be, and scenes that cannot be read, nearest first.
    kin : list of Finding
        Pairs that are near because one was made from the family of the other.
    """
    if not near >= 0.0:
        raise ValueError(f"near = {near}, must be >= 0 (a config distance)")
    problems: list[Finding] = []
    kin: list[Finding] = []
    groups: dict[str, list[Template]] = defaultdict(list)
    for record in tqdm(list(templates), desc="audit", unit="template"):
        try:
            scene = recorded_scene(record.scene, record.id)
        except ValueError as error:
            problems.append(Finding("scene", (record.id,), str(error)))
            continue
        template = Template(SampleId.parse(record.id), record.split, scene)
        groups[structure(scene)].append(template)
    for name in sorted(groups):
        for one, other, distance in _close_pairs(groups[name], near):
            related = one.sample.family == other.sample.family
            meant = related and distance > KIN * near
            (kin if meant else problems).append(_finding(one, other, distance))
    return sorted(problems, key=_order), sorted(kin, key=_order)


def _close_pairs(
    group: Sequence[Template], near: float
) -> Iterator[tuple[Template, Template, float]]:
    """Pairs of templates of two splits and one structure that are near.

    Matching objects takes long, so it is done only where it decides: the mean
    difference of two signatures as they are is the most that the distance can be, and
    that of their numbers in order of size is the least.
    """
    by_split: dict[str, list[Template]] = defaultdict(list)
    for template in sorted(group, key=lambda t: str(t.sample)):
        by_split[template.split].append(template)
    for a, b in combinations(sorted(by_split), 2):
        numbers = np.array([template.numbers for template in by_split[b]])
        ranked = np.sort(numbers, axis=1)
        for one in by_split[a]:
            most = np.abs(numbers - one.numbers).mean(axis=1)
            least = np.abs(ranked - np.sort(one.numbers)).mean(axis=1)
            for i in np.flatnonzero(least <= near + ROUNDING):
                other, distance = by_split[b][i], float(most[i])
                if distance > near:
                    distance = config_distance(one.scene, other.scene)
                if distance <= near:
                    yield one, other, distance


def _finding(one: Template, other: Template, distance: float) -> Finding:
    view = view_distance(one.covered, other.covered)
    detail = (
        f"in {one.split} and {other.split}, config distance {distance:.2g}, "
        f"first-frame distance {view:.2g}"
    )
    return Finding("near", (str(one.sample), str(other.sample)), detail, distance)


def _order(finding: Finding) -> tuple[float, tuple[str, ...]]:
    return finding.distance or 0.0, finding.ids
