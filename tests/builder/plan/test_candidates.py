"""The k-th candidate for a sample follows from the sample and k alone."""

import dataclasses
import json

import pytest

from mpmworlds.builder.plan import candidates
from mpmworlds.builder.plan.candidates import (
    NoCandidateError,
    reason_of,
    scene_key,
)
from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.plan.profile import Batch, Count
from mpmworlds.builder.recipes.modify import EDITS
from mpmworlds.builder.recipes.objects import NoRoomError
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.splits.ids import SampleId
from tests.builder.plan.plans import SMALL
from tests.sim.scenes import BODY, FAN, JET, OBSTACLE, scene_data, seeds_data

PROFILE = dataclasses.replace(
    SMALL,
    root_seed=13,
    parents=(Batch(3, 35),),
    children=(Count(4),),
    root_perturbations=(Count(5),),
)
PARENT, CHILD = SampleId.parse("p0001"), SampleId.parse("p0001-c3")


def attempt(draw, k):
    """The k-th candidate, None if it is no valid scene."""
    try:
        return draw(k)
    except (SceneError, NoRoomError):
        return None


def parent(k, profile=PROFILE, sample=PARENT):
    return candidates.parent(profile, sample, k, seeds_data())


@pytest.fixture(scope="module")
def parents():
    """The first candidates for a parent, None for those that are not valid."""
    return [attempt(parent, k) for k in range(12)]


@pytest.fixture(scope="module")
def origin(parents):
    """A parent."""
    return next(filter(None, parents))


@pytest.fixture(scope="module")
def child(origin):
    """Function k -> candidate for a child."""
    pool = [o for name in origin.seeds for o in seeds_data()[name]["objects"]]
    return lambda k: candidates.child(PROFILE, origin, CHILD, k, pool)


def test_a_candidate_for_a_parent_does_not_depend_on_others(parents):
    again = [attempt(parent, k) for k in reversed(range(12))][::-1]
    assert again == parents
    valid = [draft for draft in parents if draft]
    assert len({draft.key for draft in valid}) == len(valid) > 2


def test_other_samples_and_root_seeds_have_other_candidates(parents):
    keys = {draft.key for draft in parents if draft}
    other = [
        attempt(lambda k: parent(k, sample=SampleId("p0002")), k) for k in range(9)
    ]
    seeded = dataclasses.replace(PROFILE, root_seed=12)
    third = [attempt(lambda k: parent(k, seeded), k) for k in range(9)]
    for drafts in (other, third):
        found = {draft.key for draft in drafts if draft}
        assert found
        assert not found & keys


def test_all_candidates_for_a_parent_have_as_many_objects_and_materials(parents):
    scenes = [draft.full for draft in parents if draft]
    assert len({len(scene.objects) for scene in scenes}) == 1
    assert len({len(scene.materials) for scene in scenes}) == 1


def test_a_parent_says_what_it_was_composed_of(origin):
    record = json.loads(origin.edit)
    assert (origin.id, origin.kind, origin.made_from) == (PARENT, "parent", "")
    assert record["operator"] == "compose"
    assert {name for name, _ in record["objects"]} <= set(origin.seeds)
    assert set(origin.seeds) <= seeds_data().keys()


def test_a_candidate_for_a_child_is_one_edit_of_what_it_was_made_from(origin, child):
    drafts = [attempt(child, k) for k in range(12)]
    assert [attempt(child, k) for k in range(12)] == drafts
    valid = [draft for draft in drafts if draft]
    assert len({draft.key for draft in valid} | {origin.key}) == len(valid) + 1 > 3
    for draft in valid:
        assert json.loads(draft.edit)["operator"] in EDITS
        assert (draft.id, draft.kind) == (CHILD, "child")
        assert (draft.made_from, draft.seeds) == ("p0001", origin.seeds)


def test_a_perturbation_has_the_lineage_of_its_template(origin):
    sample = SampleId.parse("p0001-n04")
    draft = candidates.perturbation(PROFILE, origin, sample)
    assert draft == candidates.perturbation(PROFILE, origin, sample)
    assert json.loads(draft.edit)["operator"] == "perturb"
    assert (draft.id, draft.kind) == (sample, "perturbation")
    assert (draft.made_from, draft.seeds) == ("p0001", origin.seeds)
    assert draft.key != origin.key


def test_a_seed_is_as_it_is():
    name, scene = list(load_seeds().items())[2]
    draft = candidates.seed(PROFILE, SampleId.parse("s02"), name, scene)
    assert (draft.kind, draft.made_from, draft.edit) == ("seed", "", "")
    assert draft.seeds == (name,)
    assert draft.full == scene


def test_a_draft_is_kept_as_the_profile_says_and_full_for_its_descendants(origin):
    kept, full = origin.kept, origin.full
    assert kept.simulation.grid_resolution == kept.output.resolution == 64
    assert kept.simulation.duration_frames == 5
    assert full.simulation.grid_resolution == 128
    assert full.simulation.duration_frames == 300
    as_it_is = dataclasses.replace(
        PROFILE, grid_resolution=128, resolution=512, duration_frames=300
    )
    assert candidates.kept(as_it_is, full) is full


def test_the_key_of_a_trial_names_the_full_scene(origin):
    assert origin.key == scene_key(origin.full) == text_sha256(origin.full.to_yaml())
    assert dataclasses.replace(origin, kept=origin.full).key == origin.key


def test_a_template_without_a_perturbation_is_named_with_the_last_fault(
    origin, monkeypatch
):
    monkeypatch.setattr(candidates, "MOST_DRAWS", 2)
    odd = dataclasses.replace(PROFILE, resolution=63)
    message = r"p0001-n04: none of 2 perturbations .*output.resolution = 63, must be"
    with pytest.raises(NoCandidateError, match=message):
        candidates.perturbation(odd, origin, SampleId.parse("p0001-n04"))


def error_of(*objects):
    with pytest.raises(SceneError) as error:
        Scene.from_data(scene_data() | {"objects": list(objects)})
    return error.value


def with_shape(thing, **shape):
    return thing | {"shape": thing["shape"] | shape}


def with_material(thing, **matter):
    return thing | {"physics_properties": thing["physics_properties"] | matter}


NEAR_RED = {"visualization": {"color": "#F45F2D"}}
TWO = {"name": "object_9", "visualization": {"color": "#969696"}}
FAULTS = {
    "overlap": [BODY, BODY | TWO],
    "domain": [with_shape(BODY, center=[0.02, 0.5])],
    "stability": [with_material(BODY, youngs_modulus=9e8)],
    "colors": [BODY, FAN | NEAR_RED],
    "particles": [OBSTACLE],
    "jets": [JET | {"emission": JET["emission"] | {"rate": 1e5}}],
    "names": [BODY, OBSTACLE | {"name": "object_0"}],
}


@pytest.mark.parametrize("word", FAULTS)
def test_a_fault_of_a_scene_has_a_word(word):
    assert reason_of(error_of(*FAULTS[word])) == word


def test_a_lack_of_room_has_a_word():
    assert reason_of(NoRoomError("no room for object_3 (overlaps)")) == "no_room"
