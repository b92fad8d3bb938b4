"""The plan of a corpus: every scene, its lineage and its split, before any is rendered.

Each sample draws from a stream keyed by its own id, so that samples can be added
without changing any other.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.builder.attempt import Data, NoCandidateError, first_valid
from mpmworlds.builder.compose import compose
from mpmworlds.builder.manifest import ManifestRow, text_sha256, write_manifest
from mpmworlds.builder.modify import modify
from mpmworlds.builder.perturb import perturb
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.builder.streams import stream
from mpmworlds.sim.emit import materials_of
from mpmworlds.sim.link import link
from mpmworlds.sim.scale import rescale
from mpmworlds.sim.scene import Scene
from mpmworlds.splits.assign import SplitParams, split_of
from mpmworlds.splits.ids import SampleId

MOST_PAIRS = 20  # pairs of seeds tried for a parent
COUNTS = (
    "parents",
    "children",
    "root_perturbations",
    "child_perturbations",
    "duration_frames",
)


@dataclass(frozen=True)
class Profile:
    """A corpus to plan: how many scenes of each kind, and at which resolution.

    Attributes
    ----------
    root_seed
        Seed of every random choice.
    seeds
        Ids of the seed scenes that are part of it, such as ``s03``. Parents are
        composed from all seeds.
    parents
        How many composed parents.
    children
        Children of each seed and each parent.
    root_perturbations, child_perturbations
        Perturbations of each seed and parent, and of each child.
    grid_resolution, resolution
        Cells and pixels per side.
    duration_frames
        Frames of a video.
    split
        Parameters of the splits.
    """

    root_seed: int
    seeds: tuple[str, ...]
    parents: int
    children: int
    root_perturbations: int
    child_perturbations: int
    grid_resolution: int
    resolution: int
    duration_frames: int
    split: SplitParams

    @classmethod
    def from_params(cls, params: dict[str, Any], name: str) -> "Profile":
        """Read a profile from the data of ``params.yaml``; raises `PlanError`."""
        profiles = params.get("profiles") or {}
        if name not in profiles:
            raise PlanError(
                f"profile {name!r} is not in params.yaml; it has {sorted(profiles)}"
            )
        start = f"params.yaml: profile {name!r}"
        try:
            fields = dict(profiles[name])
            return cls(
                split=SplitParams(**fields.pop("split")),
                seeds=tuple(fields.pop("seeds")),
                root_seed=params["root_seed"],
                **fields,
            )
        except KeyError as error:
            raise PlanError(f"{start}: {error} is missing; add it") from None
        except (TypeError, ValueError) as error:
            raise PlanError(f"{start}: {error}") from None

    def __post_init__(self) -> None:
        """Refuse what cannot be a number of scenes or frames."""
        for name in COUNTS:
            value, least = getattr(self, name), int(name == "duration_frames")
            if not isinstance(value, int) or value < least:
                raise PlanError(
                    f"{name} = {value!r}, must be a whole number >= {least}"
                )


class PlanError(ValueError):
    """Parameters from which no corpus can be planned."""


@dataclass(frozen=True)
class Draft:
    """A planned sample: at full resolution for its descendants, and as it is kept."""

    id: SampleId
    kind: str
    made_from: str
    seeds: tuple[str, ...]
    edit: str
    full: Scene
    kept: Scene


def write_plan(profile: Profile, path: Path) -> list[ManifestRow]:
    """Plan a corpus and write its manifest.

    Parameters
    ----------
    profile
        What to plan.
    path
        File to write.

    Returns
    -------
    list of ManifestRow
        What was written, in the order of the ids.

    Raises
    ------
    PlanError
        If the profile asks for a seed that there is not.
    NoCandidateError
        If no draw for a sample is a valid scene.
    """
    drafts = tqdm(
        plan(profile), desc="plan", unit="scene", total=len(sample_ids(profile))
    )
    rows = sorted((_row(draft, profile) for draft in drafts), key=lambda row: row.id)
    write_manifest(path, rows)
    return rows


def sample_ids(profile: Profile) -> list[str]:
    """Ids of a corpus, sorted, without planning its scenes."""
    roots = [SampleId.parse(seed) for seed in profile.seeds]
    roots += [SampleId.parse(f"p{i:04d}") for i in range(profile.parents)]
    children = [SampleId(r.family, j) for r in roots for j in range(profile.children)]
    perturbed = [
        SampleId(template.family, template.child, j)
        for template, count in [
            *((root, profile.root_perturbations) for root in roots),
            *((child, profile.child_perturbations) for child in children),
        ]
        for j in range(count)
    ]
    return sorted(map(str, roots + children + perturbed))


def plan(profile: Profile) -> Iterator[Draft]:
    """Yield the samples of a corpus: roots, their children, then perturbations."""
    for root in _roots(profile, load_seeds()):
        family, templates = root.id.family, [root]
        for j in range(profile.children):
            sample = SampleId(family, j)
            templates.append(_descendant(profile, root, sample, "child"))
        yield from templates
        for template in templates:
            count = profile.child_perturbations
            if template is root:
                count = profile.root_perturbations
            for j in range(count):
                sample = SampleId(family, template.id.child, j)
                yield _descendant(profile, template, sample, "perturbation")


def _roots(profile: Profile, seeds: dict[str, Scene]) -> Iterator[Draft]:
    names = {name.split("_")[0]: name for name in seeds}
    for seed in profile.seeds:
        if seed not in names:
            raise PlanError(f"there is no seed {seed!r}; there are {', '.join(names)}")
        scene = seeds[names[seed]]
        sample, kept = SampleId.parse(seed), _kept(profile, scene)
        yield Draft(sample, "seed", "", (names[seed],), "", scene, kept)
    for i in range(profile.parents):
        yield _parent(profile, i, seeds)


def _parent(profile: Profile, i: int, seeds: dict[str, Scene]) -> Draft:
    """Compose two seeds; a pair that leaves no room gives way to another."""
    sample = SampleId.parse(f"p{i:04d}")
    rng, fault = stream(profile.root_seed, "parent", str(sample)), ""
    for _ in range(MOST_PAIRS):
        base, other = rng.permutation(sorted(seeds))[:2].tolist()
        edit = partial(compose, rng, other=seeds[other].to_data())
        try:
            full, kept, record = _edited(profile, str(sample), seeds[base], edit)
        except NoCandidateError as error:
            fault = str(error)
            continue
        return Draft(sample, "parent", "", (base, other), record, full, kept)
    raise NoCandidateError(
        f"{sample}: no pair of seeds can be composed; add seeds (last: {fault})"
    )


def _descendant(profile: Profile, origin: Draft, sample: SampleId, kind: str) -> Draft:
    """A child or perturbation of a sample."""
    rng = stream(profile.root_seed, kind, str(sample))
    edit = partial({"child": modify, "perturbation": perturb}[kind], rng)
    full, kept, record = _edited(profile, str(sample), origin.full, edit)
    return Draft(sample, kind, str(origin.id), origin.seeds, record, full, kept)


def _edited(
    profile: Profile, name: str, start: Scene, edit: Callable[[Data], Data]
) -> tuple[Scene, Scene, str]:
    """An edited scene, as it is kept in the profile, and the record of the edit."""

    def both(scene: Scene) -> tuple[Scene, Scene]:
        return scene, _kept(profile, scene)

    (full, kept), record = first_valid(edit, start.to_data(), both, name)
    return full, kept, json.dumps(record, sort_keys=True)


def _kept(profile: Profile, scene: Scene) -> Scene:
    return rescale(
        scene, profile.grid_resolution, profile.resolution, profile.duration_frames
    )


def _row(draft: Draft, profile: Profile) -> ManifestRow:
    text = draft.kept.to_yaml()
    materials = sorted(materials_of(draft.kept))
    return ManifestRow(
        id=str(draft.id),
        kind=draft.kind,
        parent_id=draft.made_from,
        family_id=draft.id.family,
        seeds=draft.seeds,
        edit=draft.edit,
        split=split_of(str(draft.id), profile.split),
        scene=text,
        materials=tuple(materials),
        object_types=tuple(sorted({o.object_type for o in draft.kept.objects})),
        num_objects=len(draft.kept.objects),
        num_materials=len(materials),
        scene_sha256=text_sha256(text),
        program_sha256=text_sha256(link(draft.kept)),
    )
