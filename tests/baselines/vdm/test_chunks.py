"""Chunks of a continuation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.baselines.vdm.chunks import continue_clip, plan_chunks, whole

LENGTHS = st.integers(0, 30).map(lambda k: 4 * k + 1)


@given(st.integers(1, 200), st.integers(1, 200), LENGTHS, LENGTHS)
def test_chunks_are_whole_and_give_the_horizon(prefix, horizon, chunk, overlap):
    chunk += overlap + 3
    known = prefix
    plan = plan_chunks(prefix, horizon, chunk, overlap)
    for one in plan:
        assert one.given == whole(one.given) <= min(known, overlap)
        assert one.given + one.new == whole(one.given + one.new) <= chunk
        assert one.new - 4 < one.kept <= one.new
        known += one.kept
    assert known == prefix + horizon
    assert all(one.kept == one.new for one in plan[:-1])


def test_the_protocol_takes_three_calls_of_wan_and_two_of_longcat():
    assert [c.kept for c in plan_chunks(38, 112, 81, 37)] == [44, 44, 24]
    assert [c.kept for c in plan_chunks(38, 112, 93, 13)] == [80, 32]


@pytest.mark.parametrize(
    ("chunk", "overlap", "told"),
    [
        (24, 5, r"chunk = 24 frames, must be 4 k \+ 1, as 21 is"),
        (9, 6, r"overlap = 6 frames, must be 4 k \+ 1, as 5 is"),
        (9, 9, "overlap = 9 frames, must be less than chunk = 9"),
    ],
)
def test_impossible_lengths_are_told(chunk, overlap, told):
    with pytest.raises(ValueError, match=told):
        plan_chunks(38, 112, chunk, overlap)


class Counter:
    """Goes on counting from the last frame."""

    name = "counter"

    def __init__(self, surplus=0):
        self.surplus = surplus

    def extend(self, given, text, new, seed):
        level = given[-1, 0, 0, 0] + 1
        frames = np.zeros((new + self.surplus, *given.shape[1:]), np.uint8)
        return (
            frames
            + np.arange(level, level + len(frames), dtype=np.uint8)[:, None, None, None]
        )


def clip_of(levels):
    return (
        np.zeros((1, 2, 2, 3), np.uint8)
        + np.array(levels, np.uint8)[:, None, None, None]
    )


def test_each_chunk_goes_on_where_the_one_before_ends():
    prefix = clip_of(range(6))
    plan = plan_chunks(6, 10, 9, 5)
    seeds = []
    found = continue_clip(Counter(), prefix, "", 10, plan, lambda k: seeds.append(k))
    assert found[:, 0, 0, 0].tolist() == list(range(6, 16))
    assert seeds == [0, 1, 2]


def test_a_backend_that_returns_another_length_is_told():
    with pytest.raises(ValueError, match=r"'counter': returned uint8 \(5, 2, 2, 3\)"):
        continue_clip(
            Counter(1), clip_of(range(6)), "", 4, plan_chunks(6, 4, 9, 5), hash
        )
