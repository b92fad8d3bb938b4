"""The numbers of a corpus are read whole or refused, and give its ids."""

from collections import Counter
from pathlib import Path

import pytest
import yaml

from mpmworlds.builder.plan.profile import Batch, Count, PlanError, Profile, sample_ids
from mpmworlds.splits.assign import SplitParams
from mpmworlds.splits.ids import SampleId

ROOT = Path(__file__).parents[3]
FIELDS = {
    "seeds": ["s00", "s02"],
    "parents": [{"count": 2, "seeds": 3}, {"count": 3, "seeds": 4}],
    "children": {"each": 1, "more": 1},
    "root_perturbations": {"each": 0, "more": 2},
    "child_perturbations": 1,
    "screen": "none",
    "grid_resolution": 64,
    "resolution": 64,
    "duration_frames": 5,
    "split": {"salt": "test", "test_fraction": 0.4, "modification_fraction": 0.5},
}
MISSING = object()


def profile_of(**other):
    fields = {k: v for k, v in (FIELDS | other).items() if v is not MISSING}
    return Profile.from_params({"root_seed": 1, "profiles": {"tiny": fields}}, "tiny")


def test_a_profile_holds_what_its_parameters_say():
    profile = profile_of()
    assert profile.seeds == ("s00", "s02")
    assert profile.parents == (Batch(2, 3), Batch(3, 4))
    assert profile.children == (Count(1, 1),)
    assert profile.child_perturbations == (Count(1, 0),)
    assert profile.split == SplitParams("test", 0.4, 0.5)
    assert (profile.root_seed, profile.duration_frames) == (1, 5)


def test_settings_of_lists_and_files_are_no_part_of_a_plan():
    assert profile_of(lists={"mini": 3}) == profile_of()
    assert profile_of(rows_per_shard=9) == profile_of()


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"split": MISSING}, "'split' is missing; add it"),
        ({"children": MISSING}, "'children' is missing; add it"),
        ({"screen": MISSING}, "screen"),
        ({"colour": "red"}, "colour"),
        ({"children": -1}, "children = -1, must be a whole number >= 0"),
        ({"children": {"each": 1.5}}, r"each = 1\.5, must be a whole number >= 0"),
        ({"children": {"each": 1, "more": -2}}, "more = -2, must be a whole number"),
        ({"children": {"every": 1}}, "every"),
        ({"children": 501}, "children: 501 each, must be <= 500"),
        ({"parents": 3}, "parents = 3, must be a list of mappings"),
        ({"parents": [{"count": -1, "seeds": 3}]}, "parents: count = -1, must be"),
        ({"parents": [{"count": 1, "seeds": 1}]}, r"parents: seeds = 1, .* >= 2"),
        ({"parents": [{"count": 1}]}, "parents: seeds = 0, must be .* >= 2"),
        ({"parents": [{"count": 0, "proposals": "x"}]}, "count = 0, must be .* >= 1"),
        ({"duration_frames": 0}, "duration_frames = 0, must be a whole number >= 1"),
        ({"resolution": "fine"}, "resolution = 'fine', must be a whole number >= 1"),
        ({"grid_resolution": True}, "grid_resolution = True, must be a whole number"),
        ({"seeds": 3}, r"seeds = 3, must be a list of ids such as \[s00, s07\]"),
        ({"seeds": [1]}, r"seeds = \[1\], must be a list of ids"),
        (
            {"split": FIELDS["split"] | {"salt": 3}},
            "salt = 3, must be a non-empty text",
        ),
        (
            {"split": FIELDS["split"] | {"test_fraction": "x"}},
            "test_fraction = 'x', mu",
        ),
        ({"screen": "all"}, "screen = 'all', must be one of none, parents, templates"),
        ({"split": {"salt": "x"}}, "test_fraction"),
    ],
)
def test_parameters_that_are_no_profile_are_an_error_that_says_where(other, message):
    with pytest.raises(PlanError, match=message) as error:
        profile_of(**other)
    assert str(error.value).startswith("params.yaml: profile 'tiny': ")


@pytest.mark.parametrize("params", [{}, {"profiles": None}, {"profiles": {"full": {}}}])
def test_a_profile_that_there_is_not_is_an_error_that_says_which_there_are(params):
    with pytest.raises(PlanError, match=r"profile 'tiny' is not in .*; it has"):
        Profile.from_params(params, "tiny")


def test_a_profile_without_a_root_seed_is_an_error():
    with pytest.raises(PlanError, match="'root_seed' is missing; add it"):
        Profile.from_params({"profiles": {"tiny": FIELDS}}, "tiny")


@pytest.mark.parametrize(
    ("name", "number"), [("s00", 3), ("p0000", 4), ("p0001", 4), ("p0002", 3)]
)
def test_the_first_so_many_parents_get_one_more(name, number):
    assert Count(3, more=2).of(SampleId.parse(name)) == number


def test_parents_are_numbered_on_from_one_batch_to_the_next():
    profile = profile_of()
    names = ["s00", "s02", "p0000", "p0001", "p0002", "p0003", "p0004"]
    assert list(map(str, profile.roots())) == names
    places = [profile.batch_of(root) for root in profile.roots()[2:]]
    assert [batch.seeds for batch, _ in places] == [3, 3, 4, 4, 4]
    assert [number for _, number in places] == [0, 1, 0, 1, 2]
    with pytest.raises(PlanError, match="p0005: is in no batch"):
        profile.batch_of(SampleId.parse("p0005"))


def test_a_family_is_a_root_its_children_and_perturbations_of_all_of_them():
    profile = profile_of()
    family = profile.family(SampleId.parse("p0000"))
    assert list(map(str, family)) == [
        *("p0000", "p0000-c0", "p0000-c1"),
        *("p0000-n00", "p0000-c0-n00", "p0000-c1-n00"),
    ]
    family = profile.family(SampleId.parse("s02"))
    assert list(map(str, family)) == ["s02", "s02-c0", "s02-c0-n00"]


def test_ids_are_those_of_all_families_in_order():
    profile = profile_of()
    ids = sample_ids(profile)
    assert ids == sorted(set(ids))
    families = [profile.family(root) for root in profile.roots()]
    assert set(ids) == {str(sample) for family in families for sample in family}


def test_the_full_corpus_is_as_large_as_it_says():
    params = yaml.safe_load((ROOT / "params.yaml").read_text())
    profile = Profile.from_params(params, "full")
    kinds = Counter(SampleId.parse(name).kind for name in sample_ids(profile))
    assert kinds["seed"] == 35
    assert kinds["seed"] + kinds["parent"] == 1_000
    assert kinds["seed"] + kinds["parent"] + kinds["child"] == 9_204
    assert kinds["perturbation"] == 86_601
    assert kinds.total() == 95_805


def test_every_profile_of_the_repository_can_be_read():
    params = yaml.safe_load((ROOT / "params.yaml").read_text())
    assert params["profiles"].keys() >= {"tiny", "full"}
    for name in params["profiles"]:
        assert sample_ids(Profile.from_params(params, name))
