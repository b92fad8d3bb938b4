"""A family of a plan: a root, its children, and the perturbations of all of them.

This is what a process of a plan does; see `plan` for how they are put together.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from mpmworlds.builder import candidates
from mpmworlds.builder.candidates import Draft
from mpmworlds.builder.manifest import ManifestRow, text_sha256
from mpmworlds.builder.profile import Profile
from mpmworlds.builder.screen import Findings
from mpmworlds.builder.templates import Choice, Screen, Templates
from mpmworlds.sim.program.link import link
from mpmworlds.splits.assign import split_of
from mpmworlds.splits.ids import SampleId

Task = tuple[Any, ...]  # a step, the root that it is done for, and what it takes


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


def carry_out(planner: Planner, task: Task) -> Any:
    """Do one step of a plan, in a process that did others before.

    Parameters
    ----------
    planner
        The plan.
    task
        ("root", id, draws that are not to be taken) or ("family", id, draft of it).

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
        choice = Choice(templates.seed(sample), 0, ())
    else:
        choice = templates.parent(sample, not_draws)
    return choice, templates.screen.take()


def plan_family(templates: Templates, root: Draft) -> Family:
    """All rows of a family."""
    profile = templates.profile
    choices = list(templates.children(root))
    drafts = [root, *(choice.draft for choice in choices)]
    rows = [row_of(draft, profile) for draft in drafts]
    by_id = {str(draft.id): draft for draft in drafts}
    for sample in profile.family(root.id)[len(drafts) :]:
        origin = by_id[sample.template]
        rows.append(row_of(candidates.perturbation(profile, origin, sample), profile))
    rejected = [reason for choice in choices for reason in choice.rejected]
    return Family(rows, rejected, templates.screen.take())


def row_of(draft: Draft, profile: Profile) -> ManifestRow:
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
        scene_sha256=text_sha256(text),
        program_sha256=text_sha256(link(draft.kept)),
    )
