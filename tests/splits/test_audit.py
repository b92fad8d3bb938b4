"""The audit: silent on a sound corpus, and no injected leak escapes it."""

import copy

import numpy as np
import pytest

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.recipes.perturb import perturb
from mpmworlds.builder.recipes.tables import first_tables
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.audit import audit
from mpmworlds.splits.duplicates import rough_text
from mpmworlds.splits.near_duplicates import NEAR, Template
from mpmworlds.splits.similarity import (
    config_distance,
    first_frame_distance,
    layout_image,
    signature,
    view_distance,
)
from tests.made_up import SPLIT, changed, records

SOUND = records()
SCENES = {record.id: record.scene for record in SOUND}
TRAIN, TEST, MODIFIED = "p0000", "p0001", "p0000-c1"


def problems(corpus, **options):
    return audit(corpus, SPLIT, **options).problems


def with_scene(sample_id, text, program="another program"):
    """Return the corpus with the scene of a row replaced, hashes and all."""
    hashes = {"scene_sha256": text_sha256(text), "program_sha256": text_sha256(program)}
    return changed([sample_id], scene=text, **hashes)


def text_of(data):
    return Scene.from_data(data).to_yaml()


def data_of(sample_id):
    return copy.deepcopy(Scene.from_yaml(SCENES[sample_id]).to_data())


def moved(data, distance):
    """Return scene data with every object moved to the right."""
    for thing in data["objects"]:
        x, y = thing["shape"]["center"]
        thing["shape"]["center"] = [x + distance, y]
    return data


def test_sound_corpus_has_no_problem():
    found = audit(SOUND, SPLIT)
    assert found.problems == ()
    assert (found.samples, found.templates) == (36, 18)
    assert {record.split for record in SOUND} == {
        *("train", "test", "modification_validation")
    }


def test_order_of_the_rows_is_irrelevant():
    assert audit(SOUND[::-1], SPLIT) == audit(SOUND, SPLIT)


# ---- the same scene


@pytest.mark.parametrize("copied_to", [TEST, "p0003-c1-n00", MODIFIED])
def test_copied_scene_in_another_split_is_found(copied_to):
    found = problems(with_scene(copied_to, SCENES["p0002-n00"]))
    (same,) = [problem for problem in found if problem.rule == "same scene"]
    assert set(same.ids) == {copied_to, "p0002-n00"}
    assert same.distance == 0.0


def test_same_scene_twice_in_one_split_is_no_leak():
    assert problems(with_scene("p0002-c1-n00", SCENES["p0000-n00"])) == ()


def test_same_program_in_another_split_is_found():
    program = f"program of {SCENES['p0002']}"
    (found,) = problems(with_scene(TEST, SCENES[TEST], program))
    assert (found.rule, set(found.ids)) == ("same program", {TEST, "p0002"})


def test_scene_that_is_not_that_of_its_checksum_is_found():
    (found,) = problems(changed(["p0002-n00"], scene=SCENES["p0002-n00"] + "\n"))
    assert (found.rule, found.ids) == ("scene_sha256", ("p0002-n00",))


def disguised(sample_id):
    """Return a scene with other names, colours and seed, its objects turned round."""
    data = data_of(sample_id)
    data["simulation"]["seed"] = 77
    colors = [thing["visualization"] for thing in data["objects"]]
    data["objects"].reverse()
    for number, (thing, color) in enumerate(zip(data["objects"], colors, strict=True)):
        thing |= {"name": f"thing_{number}", "visualization": color}
    return text_of(data)


@pytest.mark.parametrize("sample_id", sorted(SCENES))
def test_rough_text_sees_through_names_order_colours_and_seed(sample_id):
    text = disguised(sample_id)
    assert text != SCENES[sample_id]
    assert rough_text(text) == rough_text(SCENES[sample_id])


def test_rough_text_tells_the_scenes_apart():
    assert len({rough_text(text) for text in SCENES.values()}) == len(SCENES)


@pytest.mark.parametrize("copied_to", [TEST, "p0003-c1-n00"])
def test_renamed_reordered_copy_is_found(copied_to):
    found = problems(with_scene(copied_to, disguised("p0002-n00")))
    (same,) = [problem for problem in found if problem.rule.endswith("rounding")]
    assert set(same.ids) == {copied_to, "p0002-n00"}


def test_copy_with_other_last_digits_is_found():
    data = data_of("p0002-n00")
    data["objects"][0]["physics_properties"]["density"] *= 1.0001
    found = problems(with_scene("p0003-n00", text_of(data)))
    assert [problem.rule for problem in found] == ["same scene after rounding"]


# ---- nearly the same scene


@pytest.mark.parametrize("copied_to", [TEST, "p0003-c1", MODIFIED])
def test_slightly_changed_copy_of_a_template_is_found(copied_to):
    text = text_of(moved(data_of("p0002-c0"), 0.004))
    near = [p for p in problems(with_scene(copied_to, text)) if p.rule == "near"]
    found = {sample_id for problem in near for sample_id in problem.ids}
    assert {copied_to, "p0002-c0"} <= found
    assert 0.0 < near[0].distance < NEAR
    assert "config distance 0.0" in str(near[0])
    assert [p.distance for p in near] == sorted(p.distance for p in near)


def test_reordered_copy_of_a_template_has_distance_zero():
    found = problems(with_scene(TEST, disguised("p0002")))
    (nearest, *_) = [problem for problem in found if problem.rule == "near"]
    assert set(nearest.ids) == {TEST, "p0002"}
    assert nearest.distance == pytest.approx(0.0, abs=1e-12)


def test_distance_is_what_is_too_near():
    text = text_of(moved(data_of("p0002"), 0.004))
    corpus = with_scene(TEST, text)
    distance = config_distance(Scene.from_yaml(text), Scene.from_yaml(SCENES["p0002"]))
    pair = {TEST, "p0002"}

    def pairs(near):
        return [set(p.ids) for p in problems(corpus, near=near) if p.rule == "near"]

    assert pair in pairs(1.01 * distance)
    assert pair not in pairs(0.99 * distance)


@pytest.mark.parametrize("origin", ["p0000", "p0002-c1", "p0004", "s05-c0"])
@pytest.mark.parametrize("stream", range(5))
def test_perturbed_copy_of_a_template_is_found(origin, stream):
    """The least that anyone would do to hide one: the corpus' own jitter, disguised."""
    data = copy.deepcopy(Scene.from_yaml(disguised(origin)).to_data())
    perturb(np.random.default_rng(stream), first_tables(), data)
    found = problems(with_scene(TEST, text_of(data)))
    near = [set(problem.ids) for problem in found if problem.rule == "near"]
    assert {origin, TEST} in near


def test_how_alike_near_scenes_look_is_told():
    data = data_of("p0000")
    body = next(o for o in data["objects"] if o["object_type"] == "dynamic_body")
    body["shape"]["size"] = [0.5 * x for x in body["shape"]["size"]]
    scene, smaller = Scene.from_yaml(SCENES["p0000"]), Scene.from_data(data)
    assert config_distance(scene, smaller) < NEAR
    found = problems(with_scene("p0003", smaller.to_yaml()))
    (near,) = [p for p in found if set(p.ids) == {"p0000", "p0003"}]
    told = float(near.detail.rpartition(" ")[2])
    assert told == pytest.approx(first_frame_distance(scene, smaller), rel=0.1)
    assert told > 0.2


def two_circles(left, right):
    """Return a scene of two equal discs, one above the other."""
    data = data_of("p0004")
    disc = next(o for o in data["objects"] if o["shape"]["type"] == "circle")
    data["objects"] = [copy.deepcopy(disc) for _ in range(2)]
    for number, (thing, x) in enumerate(
        zip(data["objects"], (left, right), strict=True)
    ):
        thing["name"] = f"object_{number}"
        thing["shape"] |= {"center": [x, 0.3 + 0.4 * number], "radius": 0.1}
    return data


def test_objects_that_change_places_in_order_are_matched():
    one, other = (text_of(two_circles(*xs)) for xs in ((0.500, 0.504), (0.504, 0.500)))
    corpus = with_scene("p0002", one)
    target = with_scene(TEST, other)
    both = [b if b.id == TEST else a for a, b in zip(corpus, target, strict=True)]
    near = [problem for problem in problems(both) if problem.rule == "near"]
    assert [set(problem.ids) for problem in near] == [{TEST, "p0002"}]
    scenes = Scene.from_yaml(one), Scene.from_yaml(other)
    unmatched = np.abs(signature(scenes[0]) - signature(scenes[1])).mean()
    assert unmatched > NEAR
    assert near[0].distance == pytest.approx(config_distance(*scenes))


def test_kept_pictures_give_the_first_frame_distance():
    one, other = (Scene.from_yaml(SCENES[name]) for name in ("p0000", "p0000-c1"))
    other = Scene.from_data(moved(other.to_data(), 0.004))
    mine, theirs = (Template(None, "train", scene) for scene in (one, other))
    assert mine.covered.any() and layout_image(one).any()
    assert view_distance(mine.covered, theirs.covered) == first_frame_distance(
        one, other
    )


def test_modification_may_be_near_its_own_family():
    kin = audit(SOUND, SPLIT).kin
    assert {"p0000-c1", "p0000"} in [set(finding.ids) for finding in kin]
    for finding in kin:
        assert len({sample_id.split("-")[0] for sample_id in finding.ids}) == 1


def test_modification_that_changes_nothing_is_found():
    data = data_of("p0000")
    data["environment"]["walls"]["friction"] += 0.001
    found = problems(with_scene(MODIFIED, text_of(data)))
    assert {"p0000", MODIFIED} in [set(p.ids) for p in found if p.rule == "near"]


def test_scene_that_cannot_be_read_is_found():
    (found,) = problems(with_scene("p0002", "# no scene\n"))
    assert (found.rule, found.ids) == ("scene", ("p0002",))
    assert "p0002: its scene cannot be read" in found.detail


def test_negative_distance_is_an_error():
    with pytest.raises(ValueError, match=r"near = -0.1, must be >= 0"):
        audit(SOUND, SPLIT, near=-0.1)
