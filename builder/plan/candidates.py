"""Candidates for a sample: its k-th draw is a pure function of its id and k."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.plan.profile import Profile
from mpmworlds.builder.plan.proposed import Proposed
from mpmworlds.builder.recipes.compose import compose, draw_counts
from mpmworlds.builder.recipes.modify import modify
from mpmworlds.builder.recipes.objects import Data, NoRoomError
from mpmworlds.builder.recipes.perturb import perturb
from mpmworlds.builder.recipes.streams import stream
from mpmworlds.sim.scene.scale import rescale
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.sim.scene.steps import steps_of, with_fewest_steps
from mpmworlds.splits.ids import SampleId

MOST_DRAWS: Final = 400
MOST_STEPS: Final = 60  # of a frame, that an edit may make necessary


class NoCandidateError(RuntimeError):
    """No draw led to a valid scene."""


@dataclass(frozen=True)
class Draft:
    """A planned sample: at full resolution for its descendants, and as it is kept.

    Attributes
    ----------
    id, kind, made_from, seeds, edit
        As in a row of the manifest.
    full, kept
        Its scene.
    """

    id: SampleId
    kind: str
    made_from: str
    seeds: tuple[str, ...]
    edit: str
    full: Scene
    kept: Scene

    @property
    def key(self) -> str:
        """Name of its trial: the hash of its scene."""
        return scene_key(self.full)


def scene_key(scene: Scene) -> str:
    """Name of the trial of a scene: the hash of its text."""
    return text_sha256(scene.to_yaml())


def seed(profile: Profile, sample: SampleId, name: str, scene: Scene) -> Draft:
    """A seed as it is."""
    return Draft(sample, "seed", "", (name,), "", scene, kept(profile, scene))


def parent(
    profile: Profile, sample: SampleId, k: int, seeds: Mapping[str, Data]
) -> Draft:
    """The k-th candidate for a parent; raises `SceneError` or `NoRoomError`."""
    tables = profile.tables_of(sample)
    counts = draw_counts(stream(profile.root_seed, "counts", str(sample)), tables)
    rng = stream(profile.root_seed, "parent", str(sample), str(k))
    data, record = compose(rng, tables, seeds, *counts)
    full = with_fewest_steps(Scene.from_data(data, str(sample)))
    names = tuple(record.pop("seeds"))
    edit = json.dumps(record, sort_keys=True)
    return Draft(sample, "parent", "", names, edit, full, kept(profile, full))


def proposed(
    profile: Profile, sample: SampleId, proposal: Proposed, origin: Draft | None = None
) -> Draft:
    """A parent, or a child of one, that a model proposed; raises `SceneError`."""
    full = with_fewest_steps(Scene.from_yaml(proposal.scene, proposal.source))
    scenes = full, kept(profile, full)
    if origin is None:
        return Draft(sample, "parent", "", proposal.seeds, proposal.edit, *scenes)
    made_from = str(origin.id)
    return Draft(sample, "child", made_from, origin.seeds, proposal.edit, *scenes)


def child(
    profile: Profile, origin: Draft, sample: SampleId, k: int, pool: list[Data]
) -> Draft:
    """The k-th candidate for a child; raises `SceneError` or `NoRoomError`."""
    rng = stream(profile.root_seed, "child", str(sample), str(k))
    data = editable(origin.full)
    record = modify(rng, profile.tables_of(sample), data, pool)
    return _descendant(profile, origin, sample, "child", data, record)


def perturbation(profile: Profile, origin: Draft, sample: SampleId) -> Draft:
    """The first valid perturbation of a template; raises `NoCandidateError`."""
    fault, tables = "", profile.tables_of(sample)
    for k in range(MOST_DRAWS):
        rng = stream(profile.root_seed, "perturbation", str(sample), str(k))
        data = editable(origin.full)
        record = perturb(rng, tables, data)
        if not record["jittered"]:
            fault = "no object has room"
            continue
        try:
            return _descendant(profile, origin, sample, "perturbation", data, record)
        except SceneError as error:
            fault = str(error).splitlines()[0]
    raise NoCandidateError(
        f"{sample}: none of {MOST_DRAWS} perturbations is a valid scene (last: {fault})"
    )


def reason_of(error: SceneError | NoRoomError) -> str:
    """A word for why a draw is no valid scene: the name of a rule, or no room."""
    return error.rule if isinstance(error, SceneError) else "no_room"


def editable(scene: Scene) -> Data:
    """Plain data of a scene, with steps for whatever an edit may make of it."""
    data = scene.to_data()
    data["simulation"] |= steps_of(scene, MOST_STEPS)
    return data


def kept(profile: Profile, scene: Scene) -> Scene:
    """A scene at the resolution and length of a profile."""
    sim, wanted = scene.simulation, profile.grid_resolution
    same = (
        sim.grid_resolution == wanted and scene.output.resolution == profile.resolution
    )
    if same and sim.duration_frames == profile.duration_frames:
        return scene
    return rescale(scene, wanted, profile.resolution, profile.duration_frames)


def _descendant(
    profile: Profile,
    origin: Draft,
    sample: SampleId,
    kind: str,
    data: Data,
    record: Data,
) -> Draft:
    full = with_fewest_steps(Scene.from_data(data, str(sample)))
    edit = json.dumps(record, sort_keys=True)
    scenes = full, kept(profile, full)
    return Draft(sample, kind, str(origin.id), origin.seeds, edit, *scenes)
