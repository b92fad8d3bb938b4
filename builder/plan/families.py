"""Families: a root, its children, and the perturbations of all of them.

A template is the first of its candidates that is valid, new, and passes its trial.
Everything here is a pure function of a profile, an id and the findings of trials, so it
can be worked out in any order and by any number of processes; `carry_out` is what each
of them does, and `plan` puts it together.
"""

import json
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any, Final

from mpmworlds.builder.plan import candidates
from mpmworlds.builder.plan.candidates import (
    MOST_DRAWS,
    Draft,
    NoCandidateError,
    editable,
    reason_of,
    scene_key,
)
from mpmworlds.builder.plan.manifest import ManifestRow, text_sha256
from mpmworlds.builder.plan.profile import (
    FIRST_PROPOSED,
    PlanError,
    Profile,
    versions,
)
from mpmworlds.builder.plan.proposed import Proposed
from mpmworlds.builder.plan.screen import Findings, fault, try_out
from mpmworlds.builder.recipes.colors import confusing
from mpmworlds.builder.recipes.objects import Data, NoRoomError
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.splits.assign import split_of
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.similarity import config_distance

NEAR_ROOTS: Final = 0.02  # config distance below which a parent is a duplicate
NEAR_SIBLINGS: Final = 0.002  # and a child of the same family
NEAR_CHANGES: Final = 0.02  # and one that changes the same object in the same way


@dataclass
class Screen:
    """Trials: those that are known, and those that are run for want of them.

    Attributes
    ----------
    known
        Findings by key, the new ones too.
    new
        Those of trials that were run here since the last time.
    asked
        Keys of all that were asked for.
    """

    known: dict[str, Findings]
    new: dict[str, Findings] = field(default_factory=dict)
    asked: set[str] = field(default_factory=set)
    _warm: WarmStart | None = None

    def findings(self, scene: Scene) -> Findings:
        """What the trial of a template shows."""
        key = scene_key(scene)
        self.asked.add(key)
        found = self.known.get(key)
        if found is None:
            self._warm = self._warm or WarmStart()
            found = self.known[key] = self.new[key] = try_out(scene, self._warm)
        return found

    def take(self) -> dict[str, Findings]:
        """All findings that were asked for since the last time."""
        found = {key: self.known[key] for key in self.asked}
        self.new, self.asked = {}, set()
        return found


@dataclass(frozen=True)
class Choice:
    """A template.

    Attributes
    ----------
    draft
        What was chosen.
    draw
        The number of its draw.
    rejected
        Why those before it were rejected.
    findings
        What its trial showed, if it was tried.
    """

    draft: Draft
    draw: int = 0
    rejected: tuple[str, ...] = ()
    findings: Findings | None = None


class Templates:
    """Chooses the templates of a corpus.

    Parameters
    ----------
    profile
        The corpus.
    screen
        Its trials; none are run for a profile without a screen.

    Raises
    ------
    PlanError
        If the profile asks for a seed that there is not.
    """

    def __init__(self, profile: Profile, screen: Screen) -> None:
        self.profile, self.screen = profile, screen
        self._scenes = load_seeds()
        self._data = {name: editable(scene) for name, scene in self._scenes.items()}
        self._names = {name.split("_")[0]: name for name in self._scenes}
        for name in profile.seeds:
            if name not in self._names:
                known = ", ".join(self._names)
                raise PlanError(f"there is no seed {name!r}; there are {known}")
        for batch in profile.parents:
            if batch.seeds > len(self._names):
                raise PlanError(
                    f"parents: seeds = {batch.seeds}, must be <= {len(self._names)}, "
                    "the number of seeds that there are"
                )

    def seed(self, sample: SampleId) -> Choice:
        """A seed as it is, whatever its trial shows."""
        name = self._names[str(sample)]
        draft = candidates.seed(self.profile, sample, name, self._scenes[name])
        return Choice(draft, findings=self._tried(draft))

    def parent(self, sample: SampleId, not_draws: Collection[int]) -> Choice:
        """First candidate for a parent that passes, but for some draws."""
        batch, number = self.profile.batch_of(sample)
        if batch.proposals:
            draw = self._only(sample, batch.proposals[number])
        else:
            names = list(self._names.values())[: batch.seeds]
            seeds = {name: self._data[name] for name in names}

            def draw(k: int) -> Draft:
                return candidates.parent(self.profile, sample, k, seeds)

        return self._first(sample, draw, [], not_draws)

    def children(self, root: Draft) -> Iterator[Choice]:
        """Children of a root, in order: those that are drawn, then the proposed."""
        pool = [thing for name in root.seeds for thing in self._data[name]["objects"]]
        draws: dict[SampleId, Callable[[int], Draft]] = {}
        for j in range(len(versions(self.profile.children, root.id))):
            sample = SampleId(root.id.family, j)
            draws[sample] = partial(self._child, root, sample, pool)
        for j, proposal in enumerate(self.profile.proposed_of(root.id), FIRST_PROPOSED):
            sample = SampleId(root.id.family, j)
            draws[sample] = self._only(sample, proposal, root)
        siblings = [root]
        for sample, draw in draws.items():
            choice = self._first(sample, draw, siblings, ())
            siblings.append(choice.draft)
            yield choice

    def _child(self, root: Draft, sample: SampleId, pool: list[Data], k: int) -> Draft:
        return candidates.child(self.profile, root, sample, k, pool)

    def _only(
        self, sample: SampleId, proposal: Proposed, origin: Draft | None = None
    ) -> Callable[[int], Draft]:
        """The draws of a sample of which there is one candidate."""

        def draw(k: int) -> Draft:
            if k:
                raise NoCandidateError(
                    f"{sample}: {proposal.source} is rejected as invalid, a near "
                    "duplicate, or by its trial; leave it out"
                )
            return candidates.proposed(self.profile, sample, proposal, origin)

        return draw

    def _first(
        self,
        sample: SampleId,
        draw: Callable[[int], Draft],
        others: list[Draft],
        not_draws: Collection[int],
    ) -> Choice:
        rejected: list[str] = []
        for k in range(MOST_DRAWS):
            try:
                draft = draw(k)
            except (SceneError, NoRoomError) as error:
                rejected.append(reason_of(error))
                continue
            reason = "near_duplicate" if k in not_draws else repeated(draft, others)
            findings = None if reason else self._tried(draft)
            reason = reason or (fault(findings) if findings else None)
            if reason is None:
                return Choice(draft, k, tuple(rejected), findings)
            rejected.append(reason)
        raise NoCandidateError(
            f"{sample}: none of {MOST_DRAWS} draws is a valid scene that passes its "
            f"trial (last: {rejected[-1]}); choose other seeds"
        )

    def _tried(self, draft: Draft) -> Findings | None:
        """What the trial of a template shows; None if the profile wants none."""
        if self.profile.screen == "none":
            return None
        if self.profile.screen == "parents" and draft.kind == "child":
            return None
        return self.screen.findings(draft.full)


def repeated(draft: Draft, others: list[Draft]) -> str | None:
    """Why a valid candidate is no good beside others of its family; None if it is.

    Children of one root differ in their edits, and those of one kind of one object
    markedly, because a modification that is held out must not have been made in
    training.
    """
    if confusing([thing.visualization.color for thing in draft.full.objects]):
        return "confusing_colors"
    if draft.edit in (other.edit for other in others):
        return "same_edit"
    if is_near(draft.full, [other.full for other in others], NEAR_SIBLINGS):
        return "near_duplicate"
    alike = [o.full for o in others if changed(o) == changed(draft)]
    if draft.kind == "child" and is_near(draft.full, alike, NEAR_CHANGES):
        return "near_edit"
    return None


def changed(draft: Draft) -> list[Any]:
    """What an edit did to which objects, whatever the numbers are."""
    record = json.loads(draft.edit or "{}")
    return [record.get(key) for key in ("operator", "object", "objects")]


def is_near(scene: Scene, others: Collection[Scene], distance: float) -> bool:
    """Whether a scene nearly repeats one of others."""
    return any(config_distance(scene, other) < distance for other in others)


Step = tuple[Any, ...]  # a step, the root that it is done for, and what it takes


@dataclass(frozen=True)
class Planner:
    """What every process needs to know.

    Attributes
    ----------
    profile
        The corpus.
    known
        Findings of trials that need not be run.
    """

    profile: Profile
    known: dict[str, Findings] = field(compare=False)


@dataclass(frozen=True)
class Family:
    """What becomes of a root.

    Attributes
    ----------
    rows
        Of all members.
    rejected
        Why candidates for children were rejected.
    trials
        Findings that the children rest on.
    """

    rows: list[ManifestRow]
    rejected: list[str]
    trials: dict[str, Findings]


def carry_out(planner: Planner, task: Step) -> Any:
    """Do one step of a plan, in a process that did others before.

    Parameters
    ----------
    planner
        The plan.
    task
        ("root", id, draws that are not to be taken) or ("family", id, its `Choice`).

    Returns
    -------
    tuple
        The id; the `Choice` and findings of the trials it rests on, or the `Family`.
    """
    step, sample, what = task
    templates = _templates(planner)
    if step == "family":
        return sample, plan_family(templates, what)
    return sample, *choose_root(templates, sample, what)


@lru_cache(1)
def _templates(planner: Planner) -> Templates:
    """Those of this process."""
    return Templates(planner.profile, Screen(dict(planner.known)))


def choose_root(
    templates: Templates, sample: SampleId, not_draws: frozenset[int]
) -> tuple[Choice, dict[str, Findings]]:
    """A seed as it is, or the first candidate for a parent that passes."""
    if sample.is_of_seed_family:
        choice = templates.seed(sample)
    else:
        choice = templates.parent(sample, not_draws)
    return choice, templates.screen.take()


def plan_family(templates: Templates, root: Choice) -> Family:
    """All rows of a family."""
    profile = templates.profile
    children = list(templates.children(root.draft))
    rows, origins = [], {}
    for choice in (root, *children):
        origins[str(choice.draft.id)] = choice.draft
        motion = choice.findings.motion if choice.findings else None
        rows.append(row_of(choice.draft, profile, motion))
    for sample in profile.family(root.draft.id)[len(rows) :]:
        draft = candidates.perturbation(profile, origins[sample.template], sample)
        rows.append(row_of(draft, profile))
    rejected = [reason for choice in children for reason in choice.rejected]
    return Family(rows, rejected, templates.screen.take())


def row_of(draft: Draft, profile: Profile, motion: float | None = None) -> ManifestRow:
    """Row of the manifest."""
    text = draft.kept.to_yaml()
    materials = sorted(draft.kept.materials)
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
        motion=motion,
        ceiling=None,
        scene_sha256=text_sha256(text),
        program_sha256=text_sha256(link(draft.kept)),
    )
