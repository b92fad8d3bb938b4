"""The reduction picks frames and pixels, and the cut is at 2.5 s."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.metrics.reduction import (
    prefix_length,
    reduce_clip,
    reduced_framerate,
    split_clip,
)


def numbered(count, side=4):
    """Return a clip whose frames hold their own number."""
    frames = np.zeros((count, side, side, 3), np.uint8)
    frames[:] = np.arange(count, dtype=np.uint8)[:, None, None, None]
    return frames


def test_the_papers_clip_becomes_150_frames_of_256_pixels():
    reduced = reduce_clip(np.zeros((300, 512, 512, 3), np.uint8), 30)
    assert reduced.shape == (150, 256, 256, 3)
    prefix, continuation = split_clip(reduced, reduced_framerate(30))
    assert (len(prefix), len(continuation)) == (38, 112)


@pytest.mark.parametrize("side", [257, 300, 512, 1000])
def test_no_colour_is_invented(side):
    rng = np.random.default_rng(side)
    frames = rng.choice(np.array([0, 44, 245], np.uint8), (1, side, side, 3))
    reduced = reduce_clip(frames, 30)
    assert reduced.shape[1:3] == (256, 256)
    assert set(np.unique(reduced)) <= {0, 44, 245}


@pytest.mark.parametrize("side", [257, 300, 512, 1000])
def test_a_pixel_is_taken_from_under_its_centre(side):
    columns = np.arange(side)
    frames = np.zeros((1, side, side, 3), np.uint8)
    frames[..., 0] = columns % 256
    frames[..., 1] = columns // 256
    reduced = reduce_clip(frames, 15)[0, 0].astype(int)
    taken = reduced[:, 0] + 256 * reduced[:, 1]
    centres = (np.arange(256) + 0.5) * side / 256
    np.testing.assert_array_equal(taken, np.floor(centres))


@given(framerate=st.integers(16, 120), count=st.integers(1, 200))
def test_a_frame_is_the_last_one_at_or_before_its_time(framerate, count):
    reduced = reduce_clip(numbered(count), framerate)[:, 0, 0, 0]
    for k, source in enumerate(reduced.tolist()):
        assert source / framerate <= k / 15 < (source + 1) / framerate
    assert len(reduced) / 15 >= count / framerate > (len(reduced) - 1) / 15


@pytest.mark.parametrize("framerate", [1, 2, 15])
def test_a_small_and_slow_clip_stays_as_it_is(framerate):
    frames = numbered(20, side=256)
    np.testing.assert_array_equal(reduce_clip(frames, framerate), frames)
    assert reduced_framerate(framerate) == framerate


@given(framerate=st.integers(1, 60))
def test_the_prefix_is_all_frames_up_to_2_5_seconds(framerate):
    length = prefix_length(framerate)
    assert (length - 1) / framerate <= 2.5 < length / framerate


def test_the_two_halves_are_the_clip():
    frames = numbered(60)
    np.testing.assert_array_equal(np.concatenate(split_clip(frames, 15)), frames)


def test_a_clip_without_a_continuation_is_refused():
    with pytest.raises(ValueError, match="must have more than 38"):
        split_clip(numbered(38), 15)


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        (np.zeros((4, 8, 8), np.uint8), "must be uint8"),
        (np.zeros((4, 8, 8, 3), np.float32), "must be uint8"),
        (np.zeros((4, 8, 9, 3), np.uint8), "9 x 8 px, must be square"),
    ],
)
def test_clips_of_another_form_are_refused(frames, message):
    with pytest.raises(ValueError, match=message):
        reduce_clip(frames, 30)


def test_a_framerate_below_one_is_refused():
    with pytest.raises(ValueError, match="framerate = 0"):
        reduce_clip(numbered(4), 0)
