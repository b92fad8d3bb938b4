"""A template is the first candidate that is valid, passes its trial, and is new."""

import copy
import dataclasses
import json
import math

import pytest

from mpmworlds.builder.plan import candidates
from mpmworlds.builder.plan import families as templates
from mpmworlds.builder.plan.candidates import NoCandidateError
from mpmworlds.builder.plan.families import Screen, Templates, is_near
from mpmworlds.builder.plan.profile import Batch, Count, PlanError
from mpmworlds.builder.plan.screen import Findings
from mpmworlds.builder.recipes.objects import NoRoomError
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.scene.checks import CHECKS
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.similarity import config_distance, structure
from tests.builder.plan.plans import SMALL
from tests.sim.scenes import seeds_data

PROFILE = dataclasses.replace(
    SMALL,
    root_seed=13,
    parents=(Batch(3, 35),),
    children=(Count(2),),
    root_perturbations=(Count(0),),
    child_perturbations=(Count(0),),
    screen="templates",
)
SAMPLE, SEED = SampleId.parse("p0002"), SampleId.parse("s02")
PASSES = Findings("ok", matter=99, travel=0.2, later=0.1, motion=0.2)
STATIC = dataclasses.replace(PASSES, travel=0.0)


class Known(dict):
    """Made-up findings: some by key, the same for all others."""

    def __init__(self, other, found=()):
        super().__init__(found)
        self.other = other

    def get(self, key):
        return self.setdefault(key, self.other)


@pytest.fixture(autouse=True)
def no_trials(monkeypatch):
    """Fail a test that runs a trial."""

    def refuse(scene, warm):
        raise AssertionError("a trial was run")

    monkeypatch.setattr(templates, "try_out", refuse)
    monkeypatch.setattr(templates, "WarmStart", object)


def chosen(screen, **other):
    return Templates(dataclasses.replace(PROFILE, **other), screen)


@pytest.fixture(scope="module")
def drafts():
    """Candidates for a parent by their number, those that are valid."""
    found = {}
    for k in range(12):
        try:
            found[k] = candidates.parent(PROFILE, SAMPLE, k, seeds_data())
        except (SceneError, NoRoomError):
            continue
    assert len(found) > 3
    return found


@pytest.fixture(scope="module")
def root(drafts):
    return next(iter(drafts.values()))


def test_the_first_valid_candidate_that_passes_is_chosen(drafts):
    choice = chosen(Screen(Known(PASSES))).parent(SAMPLE, ())
    assert choice.draw == next(iter(drafts))
    assert choice.draft == drafts[choice.draw]


def test_a_rejected_candidate_gives_way_to_the_next(drafts):
    first, second, third = list(drafts)[:3]
    bad = {
        drafts[first].key: STATIC,
        drafts[second].key: dataclasses.replace(PASSES, lost=3),
    }
    choice = chosen(Screen(Known(PASSES, bad))).parent(SAMPLE, ())
    assert choice.draft == drafts[third]
    assert len(choice.rejected) == choice.draw == third
    assert choice.rejected[first] == "static"
    assert choice.rejected[second] == "not_finite_or_outside"
    invalid = [choice.rejected[k] for k in range(third) if k not in drafts]
    assert set(invalid) <= {"no_room", "form", *CHECKS}


def test_draws_that_may_not_be_taken_count_as_near_duplicates(drafts):
    first, second = list(drafts)[:2]
    screen = Screen(Known(PASSES))
    choice = chosen(screen).parent(SAMPLE, {first})
    assert choice.draft == drafts[second]
    assert choice.rejected[first] == "near_duplicate"
    assert screen.asked == {drafts[second].key}


def test_children_are_drawn_until_they_pass(root):
    found = Known(PASSES)
    children = chosen(Screen(found))
    before = list(children.children(root))
    assert [str(choice.draft.id) for choice in before] == ["p0002-c0", "p0002-c1"]
    found[before[0].draft.key] = STATIC
    after = list(children.children(root))
    assert after[0].draw > before[0].draw
    assert after[0].rejected[before[0].draw] == "static"
    assert after[1] == before[1]


def test_a_child_that_nearly_repeats_one_of_its_family_is_drawn_again(
    root, monkeypatch
):
    monkeypatch.setattr(templates, "NEAR_SIBLINGS", math.inf)
    choices = list(chosen(Screen(Known(PASSES)), children=(Count(5),)).children(root))
    family = [root.full, *(choice.draft.full for choice in choices)]
    assert len(set(map(structure, family))) == len(family)
    assert "near_duplicate" in {r for choice in choices for r in choice.rejected}


def test_no_two_children_of_a_root_are_made_by_the_same_edit(root):
    found = list(chosen(Screen(Known(PASSES)), children=(Count(24),)).children(root))
    edits = [choice.draft.edit for choice in found]
    assert len(set(edits)) == len(edits)
    assert "same_edit" in {reason for choice in found for reason in choice.rejected}


def test_children_take_what_is_added_from_the_seeds_of_their_root(root):
    kinds = {o["shape"]["type"] for n in root.seeds for o in seeds_data()[n]["objects"]}
    added = 0
    for choice in chosen(Screen(Known(PASSES)), children=(Count(16),)).children(root):
        if json.loads(choice.draft.edit)["operator"] == "add_object":
            added += 1
            assert choice.draft.full.objects[-1].shape.type in kinds
    assert added


@pytest.mark.parametrize("kinds", [[], ["parent"], ["parent", "child"]])
def test_only_what_the_profile_says_is_tried(root, kinds):
    screen = Screen(Known(PASSES))
    name = ("none", "parents", "templates")[len(kinds)]
    found = Templates(dataclasses.replace(PROFILE, screen=name), screen)
    drafts = [found.seed(SEED).draft, found.parent(SAMPLE, ()).draft]
    drafts += [choice.draft for choice in found.children(root)]
    tried = {"seed", *kinds} if kinds else set()
    assert screen.asked == {draft.key for draft in drafts if draft.kind in tried}


def test_a_seed_is_a_template_as_it_is():
    draft = chosen(Screen(Known(STATIC))).seed(SEED).draft
    assert (draft.kind, draft.seeds) == ("seed", ("s02_sand_funnel",))
    assert draft.full == load_seeds()["s02_sand_funnel"]


def test_parents_of_a_batch_are_composed_of_its_seeds_only():
    few = chosen(Screen(Known(PASSES)), parents=(Batch(3, 2),))
    names = set(list(seeds_data())[:2])
    assert all(
        set(few.parent(SampleId(f"p000{i}"), ()).draft.seeds) <= names for i in range(3)
    )


def test_a_screen_hands_over_what_was_asked_for_once(drafts):
    one, other = list(drafts.values())[:2]
    screen = Screen({one.key: STATIC, other.key: PASSES, "not asked for": PASSES})
    assert screen.findings(one.full) == STATIC
    assert screen.findings(other.full) == PASSES
    assert screen.take() == {one.key: STATIC, other.key: PASSES}
    assert screen.take() == {}


def test_a_trial_that_is_not_known_is_run_once(drafts, monkeypatch):
    run = []

    def try_out(scene, warm):
        run.append(scene)
        return STATIC

    monkeypatch.setattr(templates, "try_out", try_out)
    screen, draft = Screen({}), next(iter(drafts.values()))
    assert screen.findings(draft.full) == screen.findings(draft.full) == STATIC
    assert screen.take() == {draft.key: STATIC}
    assert screen.findings(draft.full) == STATIC
    assert run == [draft.full]


def test_a_sample_without_a_candidate_is_named_with_the_last_reason(monkeypatch):
    monkeypatch.setattr(templates, "MOST_DRAWS", 3)
    message = r"p0002: none of 3 draws .* \(last: .+\); choose other seeds"
    with pytest.raises(NoCandidateError, match=message):
        chosen(Screen({}), resolution=63).parent(SAMPLE, ())


def test_a_seed_that_there_is_not_is_an_error():
    with pytest.raises(PlanError, match="no seed 's99'; there are s00, s01"):
        chosen(Screen({}), seeds=("s99",))


def test_more_seeds_than_there_are_is_an_error():
    message = f"parents: seeds = 999, must be <= {len(seeds_data())}"
    with pytest.raises(PlanError, match=message):
        chosen(Screen({}), parents=(Batch(1, 999),))


def test_near_is_nearer_than_a_distance_and_of_the_same_structure(root):
    data = copy.deepcopy(root.full.to_data())
    data["environment"]["gravity"][1] += 0.5
    near = Scene.from_data(data)
    distance = config_distance(root.full, near)
    assert is_near(near, [root.full], 1.01 * distance)
    assert not is_near(near, [root.full], distance)
    assert is_near(root.full, [near, root.full], 1e-9)
    other = Scene.from_data(seeds_data()["s19_five_materials"])
    assert not is_near(root.full, [other], 1e9)
    assert not is_near(root.full, [], 1e9)
