"""The properties that make the splits what they claim to be."""

import hashlib
import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.splits import SPLITS, SampleId, SplitParams, assign, split_of

PARAMS = SplitParams("mpmworlds-splits-1", 0.1, 0.08)


def corpus(parents, children=9, perturbations=9):
    """Return the ids of whole families: parents, children, perturbations of both."""
    ids = []
    for number in range(parents):
        family = f"p{number:04d}"
        templates = [family, *(f"{family}-c{child}" for child in range(children))]
        for template in templates:
            ids.append(template)
            ids += [f"{template}-n{n:02d}" for n in range(perturbations)]
    return ids


THOUSAND = corpus(10)
TEN_THOUSAND = corpus(100)

some_ids = st.lists(st.sampled_from(TEN_THOUSAND), unique=True, max_size=40)
some_params = st.builds(
    SplitParams,
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1),
    st.floats(0.0, 0.9),
    st.floats(0.0, 0.9),
)


@given(some_ids, some_ids, some_params)
def test_adding_samples_moves_no_other(old, new, params):
    before = assign(old, params)
    after = assign(set(old) | set(new), params)
    for split in SPLITS:
        assert set(before[split]) == set(after[split]) & set(old)


@given(st.permutations(TEN_THOUSAND[:60]), some_params)
def test_order_of_the_ids_is_irrelevant(ids, params):
    assert assign(ids, params) == assign(TEN_THOUSAND[:60], params)


@given(some_ids, some_params)
def test_no_family_crosses_into_test(ids, params):
    lists = assign(ids, params)
    families = {
        split: {SampleId.parse(member).family for member in lists[split]}
        for split in SPLITS
    }
    seen = families["train"] | families["modification_validation"]
    assert not families["test"] & seen


@given(st.sampled_from(TEN_THOUSAND), some_params)
def test_perturbations_stay_with_their_template(sample_id, params):
    template = SampleId.parse(sample_id).template
    assert split_of(sample_id, params) == split_of(template, params)


@given(some_params)
def test_every_id_is_in_exactly_one_split(params):
    lists = assign(THOUSAND, params)
    assert tuple(lists) == SPLITS
    assert sorted(itertools.chain(*lists.values())) == sorted(THOUSAND)


def test_parents_of_modified_children_train():
    lists = assign(TEN_THOUSAND, PARAMS)
    assert lists["modification_validation"]
    for member in lists["modification_validation"]:
        assert SampleId.parse(member).child is not None
        assert split_of(SampleId.parse(member).family, PARAMS) == "train"


def test_families_of_seeds_are_never_in_test():
    params = SplitParams("salt", 0.99, 0.0)
    assert {split_of(f"s{n:02d}-c1-n01", params) for n in range(35)} == {"train"}


def test_fractions_are_approached_on_many_ids():
    families = [f"p{number:04d}" for number in range(10_000)]
    share = len(assign(families, PARAMS)["test"]) / len(families)
    assert share == pytest.approx(0.1, abs=3 * (0.1 * 0.9 / 10_000) ** 0.5)
    children = [f"{family}-c0" for family in families]
    lists = assign(children, PARAMS)
    seen = len(children) - len(lists["test"])
    share = len(lists["modification_validation"]) / seen
    assert share == pytest.approx(0.08, abs=3 * (0.08 * 0.92 / seen) ** 0.5)


def test_division_of_a_thousand_ids_is_pinned():
    """Another checksum would be another division: a new version of the splits."""
    lists = assign(THOUSAND, PARAMS)
    text = "".join(f"{member} {split}\n" for split in SPLITS for member in lists[split])
    assert len(THOUSAND) == 1000
    assert hashlib.sha256(text.encode()).hexdigest() == (
        "f91916b4dcc5785eb67767fd23cb50610e9d55086a21940d5361a8f8f960bbe1"
    )


def test_another_salt_divides_otherwise():
    other = SplitParams("mpmworlds-splits-2", 0.1, 0.08)
    assert assign(TEN_THOUSAND, other) != assign(TEN_THOUSAND, PARAMS)


def test_repeated_id_is_an_error():
    with pytest.raises(ValueError, match="'p0001': occurs twice"):
        assign(["p0001", "p0002", "p0001"], PARAMS)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("", 0.1, 0.1), "split salt = ''"),
        (("a\0b", 0.1, 0.1), "without NUL"),
        (("a", 1.0, 0.1), r"test_fraction = 1.0, must be in \[0, 1\)"),
        (("a", 0.1, -0.1), "modification_fraction = -0.1"),
        (("a", float("nan"), 0.1), "test_fraction = nan"),
    ],
)
def test_impossible_parameters_are_errors(arguments, message):
    with pytest.raises(ValueError, match=message):
        SplitParams(*arguments)
