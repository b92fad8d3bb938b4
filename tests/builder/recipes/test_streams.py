"""A stream belongs to its name and to nothing else."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.recipes.streams import stream

paths = st.tuples(st.integers(0, 99), st.sampled_from("ab"), st.sampled_from(["", "c"]))


def numbers(path):
    return stream(*path).integers(2**63, size=4).tolist()


@given(st.lists(paths, min_size=2, max_size=6, unique=True), st.randoms())
def test_streams_do_not_depend_on_the_order_of_their_use(names, random):
    first = {name: numbers(name) for name in names}
    random.shuffle(names)
    assert {name: numbers(name) for name in names} == first
    assert len({tuple(values) for values in first.values()}) == len(names)


def test_drawing_from_one_stream_leaves_another_alone():
    one, other = stream(1, "a"), stream(1, "b")
    one.random(1000)
    np.testing.assert_array_equal(other.random(5), stream(1, "b").random(5))


def test_names_are_a_path_not_a_text():
    assert numbers((1, "ab", "c")) != numbers((1, "a", "bc"))
    assert numbers((1, "2", "c")) != numbers((12, "", "c"))
