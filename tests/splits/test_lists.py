"""Evaluation lists and subsets: nested, stable as the corpus grows, rich in bases."""

import hashlib
import itertools
from dataclasses import replace

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.splits import (
    SPLITS,
    ListParams,
    SampleId,
    SplitParams,
    assign,
    compute_lists,
)

SPLIT = SplitParams("mpmworlds-splits-1", 0.3, 0.3)
YAML = """
salt: lists-1
evaluation: {test: 40, modification_validation: 20}
weights: {seed: 8, parent: 8, child: 4, perturbation: 1}
subsets:
  10k: {train: 300, test: 40, modification_validation: 20}
  mini: {train: 30, test: 8, modification_validation: 5}
"""
DATA = yaml.safe_load(YAML)
LISTS = ListParams(**DATA)
FEW = replace(
    LISTS,
    evaluation={"test": 2, "modification_validation": 2},
    subsets={"mini": {"train": 3, "test": 1}},
)


def families(numbers, children=4, perturbations=6):
    """Return the ids of whole families and of one family of a seed."""
    ids = []
    for root in ["s03", *(f"p{number:04d}" for number in numbers)]:
        for template in [root, *(f"{root}-c{child}" for child in range(children))]:
            ids.append(template)
            ids += [f"{template}-n{n:02d}" for n in range(perturbations)]
    return ids


IDS = families(range(60))
CHOSEN = compute_lists(IDS, SPLIT, LISTS)


def test_profile_without_lists_has_the_splits_only():
    assert compute_lists(IDS, SPLIT) == assign(IDS, SPLIT)


def test_lists_are_named_by_subset_and_split():
    assert list(CHOSEN) == [
        *SPLITS,
        *("evaluation_test", "evaluation_modification"),
        *("10k_train", "10k_modification_validation", "10k_test"),
        *("mini_train", "mini_modification_validation", "mini_test"),
    ]
    counts = {name: len(ids) for name, ids in CHOSEN.items() if name not in SPLITS}
    assert list(counts.values()) == [40, 20, 300, 20, 40, 30, 5, 8]


def test_chosen_ids_are_of_their_split():
    sources = {"evaluation_test": "test"}
    sources["evaluation_modification"] = "modification_validation"
    sources |= {f"{s}_{split}": split for s in LISTS.subsets for split in SPLITS}
    for name, split in sources.items():
        assert set(CHOSEN[name]) < set(CHOSEN[split])
        assert CHOSEN[name] == sorted(CHOSEN[name])


@pytest.mark.parametrize("split", SPLITS)
def test_smaller_subset_is_part_of_the_larger(split):
    assert set(CHOSEN[f"mini_{split}"]) < set(CHOSEN[f"10k_{split}"])


def test_subset_of_that_size_holds_the_evaluation_lists():
    assert CHOSEN["10k_test"] == CHOSEN["evaluation_test"]
    assert CHOSEN["10k_modification_validation"] == CHOSEN["evaluation_modification"]


@pytest.mark.parametrize("subset", ["10k", "mini"])
def test_what_was_modified_is_among_the_training_samples(subset):
    modified = CHOSEN[f"{subset}_modification_validation"]
    roots = {SampleId.parse(sample_id).family for sample_id in modified}
    assert len(roots) > 2
    assert roots <= set(CHOSEN[f"{subset}_train"])


def test_training_samples_that_do_not_hold_the_roots_are_an_error():
    few = replace(LISTS, subsets={"mini": {"train": 2, "modification_validation": 5}})
    with pytest.raises(ValueError, match="list 'mini_train': n = 2 samples, must"):
        compute_lists(IDS, SPLIT, few)


def test_modification_without_its_root_is_an_error():
    ids = [sample_id for sample_id in IDS if "-" in sample_id]
    with pytest.raises(ValueError, match="is not among the ids, must be: a mod"):
        compute_lists(ids, SPLIT, LISTS)


def test_subset_may_have_no_training_samples():
    held = replace(LISTS, subsets={"held": {"test": 3, "modification_validation": 5}})
    assert compute_lists(IDS, SPLIT, held)["held_train"] == []


def test_base_scenes_are_favoured_in_training_and_not_in_evaluation():
    def share(name):
        kinds = [SampleId.parse(i).kind for i in CHOSEN[name]]
        return sum(kind != "perturbation" for kind in kinds) / len(kinds)

    assert share("10k_train") > 2.0 * share("train")
    error = (share("test") * (1.0 - share("test")) / 40) ** 0.5
    assert share("evaluation_test") == pytest.approx(share("test"), abs=3 * error)


def test_kind_of_weight_zero_is_never_chosen():
    bases = replace(LISTS, weights=LISTS.weights | {"perturbation": 0})
    subset = {"bases": {"train": 100}}
    chosen = compute_lists(IDS, SPLIT, replace(bases, subsets=subset))
    assert {SampleId.parse(i).perturbation for i in chosen["bases_train"]} == {None}


@given(st.sets(st.integers(0, 59), min_size=20), st.sets(st.integers(60, 99)))
def test_added_samples_only_displace(old, new):
    before = compute_lists(families(old, 3, 1), SPLIT, FEW)
    after = compute_lists(families(old | new, 3, 1), SPLIT, FEW)
    for name in before.keys() - set(SPLITS):
        newcomers = set(after[name]) - set(before[name])
        assert {SampleId.parse(i).family for i in newcomers} <= {
            f"p{number:04d}" for number in new
        }


def test_order_of_the_ids_is_irrelevant():
    assert compute_lists(reversed(IDS), SPLIT, LISTS) == CHOSEN


def test_another_salt_chooses_others_from_the_same_splits():
    other = compute_lists(IDS, SPLIT, replace(LISTS, salt="lists-2"))
    assert all(other[split] == CHOSEN[split] for split in SPLITS)
    assert other["mini_train"] != CHOSEN["mini_train"]


def test_choice_is_pinned():
    """Another checksum would be another choice: a new version of the lists."""
    text = "\n".join(itertools.chain(*CHOSEN.values()))
    assert hashlib.sha256(text.encode()).hexdigest() == (
        "b9f9863bd2e2e481d708b6dce00024434ca5a407bd946d3eb9ad8f2fb21dbfec"
    )


def test_more_than_there_are_is_an_error_that_names_the_list():
    greedy = replace(LISTS, evaluation={"test": 9999})
    with pytest.raises(ValueError, match="list 'evaluation_test': sample of n = 9999"):
        compute_lists(IDS, SPLIT, greedy)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"salt": ""}, "lists salt = ''"),
        ({"salt": 3}, "lists salt = 3, must be a non-empty text"),
        ({"size": 3}, "must have the keys salt, evaluation, weights, subsets and no"),
        ({"evaluation": 152}, "lists evaluation = 152, must be a mapping"),
        ({"evaluation": {"train": 1}}, "lists evaluation: 'train', must be one of"),
        ({"evaluation": {"test": -1}}, "test = -1, must be a whole number >= 0"),
        ({"evaluation": {"test": True}}, "test = True, must be a whole number >= 0"),
        ({"weights": {"seed": 1}}, "must have the keys seed, parent, child, pert"),
        ({"weights": DATA["weights"] | {"seed": "x"}}, "seed = 'x', must be finite"),
        ({"weights": DATA["weights"] | {"seed": -1}}, "seed = -1, must be finite"),
        ({"subsets": ["10k"]}, r"lists subsets = \['10k'\], must be a mapping"),
        ({"subsets": {"10-k": {}}}, "name '10-k', must be lower-case letters"),
        ({"subsets": {"evaluation": {}}}, "and not 'evaluation'"),
        ({"subsets": {"10k": {"dev": 1}}}, "subsets: 10k: 'dev', must be one of train"),
    ],
    ids=str,
)
def test_impossible_parameters_are_errors(change, message):
    params = {"profiles": {"full": {"lists": DATA | change}}}
    with pytest.raises(ValueError, match=message):
        ListParams.from_params(params, "full")


@pytest.mark.parametrize(
    ("profile", "expected"),
    [({"lists": DATA}, LISTS), ({"seeds": []}, None), ({"lists": None}, None)],
)
def test_profile_may_ask_for_lists(profile, expected):
    params = {"profiles": {"full": profile}}
    assert ListParams.from_params(params, "full") == expected


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"profiles": {"full": {"lists": "all"}}}, "'full': lists = 'all', must have"),
        (
            {"profiles": {"tiny": {}}},
            r"'full' is not in params.yaml; it has \['tiny'\]",
        ),
        ({}, r"'full' is not in params.yaml; it has \[\]"),
    ],
)
def test_fault_names_the_profile(params, message):
    with pytest.raises(ValueError, match=message):
        ListParams.from_params(params, "full")
