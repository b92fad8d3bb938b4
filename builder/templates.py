"""Templates: the candidates that are valid, pass their trial, and are new.

Everything here is a pure function of a profile, an id and the findings of trials, so it
can be worked out in any order and by any number of processes.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from mpmworlds.builder import candidates
from mpmworlds.builder.candidates import (
    MOST_DRAWS,
    Draft,
    NoCandidateError,
    editable,
    reason_of,
    scene_key,
)
from mpmworlds.builder.parts import Data, NoRoomError
from mpmworlds.builder.profile import FIRST_PROPOSED, PlanError, Profile
from mpmworlds.builder.proposed import Proposed
from mpmworlds.builder.screen import Findings, fault, try_out
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.similarity import config_distance

NEAR_ROOTS: Final = 0.02  # config distance below which a parent is a duplicate
NEAR_SIBLINGS: Final = 0.002  # and a child of the same family


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

    def fault(self, scene: Scene) -> str | None:
        """Why a template is rejected; None if it is not."""
        key = scene_key(scene)
        self.asked.add(key)
        found = self.known.get(key)
        if found is None:
            self._warm = self._warm or WarmStart()
            found = self.known[key] = self.new[key] = try_out(scene, self._warm)
        return fault(found)

    def take(self) -> dict[str, Findings]:
        """All findings that were asked for since the last time."""
        found = {key: self.known[key] for key in self.asked}
        self.new, self.asked = {}, set()
        return found


@dataclass(frozen=True)
class Choice:
    """A template, the number of its draw, and why those before it were rejected."""

    draft: Draft
    draw: int
    rejected: tuple[str, ...]


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

    def seed(self, sample: SampleId) -> Draft:
        """A seed as it is."""
        name = self._names[str(sample)]
        return candidates.seed(self.profile, sample, name, self._scenes[name])

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
        for j in range(self.profile.children.of(root.id)):
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
                if k in not_draws:
                    reason: str | None = "near_duplicate"
                else:
                    draft = draw(k)
                    reason = self._reason(draft, others)
            except (SceneError, NoRoomError) as error:
                reason = reason_of(error)
            if reason is None:
                return Choice(draft, k, tuple(rejected))
            rejected.append(reason)
        raise NoCandidateError(
            f"{sample}: none of {MOST_DRAWS} draws is a valid scene that passes its "
            f"trial (last: {rejected[-1]}); choose other seeds"
        )

    def _reason(self, draft: Draft, others: list[Draft]) -> str | None:
        """Why a valid candidate is rejected.

        Children of one root differ in their edits, because a modification that is held
        out must not have been made in training.
        """
        if draft.edit in (other.edit for other in others):
            return "same_edit"
        if is_near(draft.full, [other.full for other in others], NEAR_SIBLINGS):
            return "near_duplicate"
        tried = ("parent",) if self.profile.screen == "parents" else ("parent", "child")
        if self.profile.screen == "none" or draft.kind not in tried:
            return None
        return self.screen.fault(draft.full)


def is_near(scene: Scene, others: Collection[Scene], distance: float) -> bool:
    """Whether a scene nearly repeats one of others."""
    return any(config_distance(scene, other) < distance for other in others)
