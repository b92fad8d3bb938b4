"""Weighted samples: stable, nested, and as heavy as their weights."""

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.splits import weighted_sample

POOL = [f"p{number:04d}" for number in range(2000)]
EQUAL = dict.fromkeys(POOL, 1.0)

subsets = st.lists(st.sampled_from(POOL), unique=True, min_size=10, max_size=60)
salts = st.text("abc", min_size=1, max_size=3)


@given(subsets, subsets, st.integers(0, 10), salts)
def test_added_ids_only_displace(old, new, n, salt):
    before = weighted_sample(old, EQUAL, n, salt)
    after = weighted_sample(set(old) | set(new), EQUAL, n, salt)
    assert set(after) & set(old) <= set(before)
    newcomers = set(after) - set(old)
    assert len(set(before) - set(after)) == len(newcomers)


@given(subsets, st.integers(0, 9), salts)
def test_smaller_sample_is_part_of_the_larger(ids, n, salt):
    smaller = weighted_sample(ids, EQUAL, n, salt)
    assert set(smaller) < set(weighted_sample(ids, EQUAL, n + 1, salt))


@given(subsets, salts)
def test_order_of_the_ids_is_irrelevant(ids, salt):
    forwards = weighted_sample(ids, EQUAL, 5, salt)
    assert forwards == weighted_sample(ids[::-1], EQUAL, 5, salt) == sorted(forwards)


@given(subsets, st.floats(1e-3, 1e3), salts)
def test_common_factor_of_the_weights_is_irrelevant(ids, factor, salt):
    scaled = dict.fromkeys(ids, factor)
    assert weighted_sample(ids, scaled, 5, salt) == weighted_sample(ids, EQUAL, 5, salt)


def test_heavy_ids_are_chosen_in_proportion():
    weights = {name: 4.0 if name < "p1000" else 1.0 for name in POOL}
    chosen = weighted_sample(POOL, weights, 100, "salt")
    heavy = sum(name < "p1000" for name in chosen)
    assert heavy == pytest.approx(80, abs=3 * (100 * 0.8 * 0.2) ** 0.5)


def test_weight_zero_is_never_chosen():
    weights = {name: float(name < "p0010") for name in POOL}
    assert weighted_sample(POOL, weights, 10, "salt") == POOL[:10]
    with pytest.raises(ValueError, match=r"n = 11, must be in \[0, 10\]"):
        weighted_sample(POOL, weights, 11, "salt")


def test_sample_of_a_thousand_is_pinned():
    weights = {name: 1.0 + number % 3 for number, name in enumerate(POOL)}
    text = "\n".join(weighted_sample(POOL, weights, 1000, "mpmworlds-10k-1"))
    assert hashlib.sha256(text.encode()).hexdigest() == (
        "b4262f18a763b4cffc919ef47cac30bd20a6b2b24247fd5a55aad643ba02bda0"
    )


@pytest.mark.parametrize("weight", [-1.0, float("nan"), float("inf")])
def test_impossible_weight_is_an_error(weight):
    with pytest.raises(ValueError, match=f"'a': weight {weight}"):
        weighted_sample(["a"], {"a": weight}, 1, "salt")


def test_missing_weight_and_repeated_id_are_errors():
    with pytest.raises(ValueError, match="'b': has no weight"):
        weighted_sample(["a", "b"], {"a": 1.0}, 1, "salt")
    with pytest.raises(ValueError, match="'a': occurs twice"):
        weighted_sample(["a", "a"], {"a": 1.0}, 1, "salt")
