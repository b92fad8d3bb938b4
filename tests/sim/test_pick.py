"""Picked pixels and frames are those of the whole video, bit for bit."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpmworlds.metrics.reduction import is_kept, reduce_clip, reduced_side
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4
from mpmworlds.sim.run.pick import decode_picked
from tests.sim.clips import noise, video_of

HALF = {"is_kept": partial(is_kept, framerate=30), "side_of": reduced_side}
ALL = {"is_kept": lambda index: True, "side_of": reduced_side}


@settings(max_examples=25)
@given(
    side=st.sampled_from([16, 32, 64, 256, 258, 300, 384, 512]),
    framerate=st.sampled_from([1, 2, 15, 16, 24, 25, 30, 60, 120]),
    count=st.integers(1, 12),
    seed=st.integers(0, 99),
)
def test_what_is_picked_is_what_reducing_the_whole_clip_gives(
    side, framerate, count, seed
):
    data = encode_mp4(noise(count, side, seed), framerate)
    kept = partial(is_kept, framerate=framerate)
    picked = decode_picked(data, kept, reduced_side)
    whole = reduce_clip(decode_mp4(data), framerate)
    np.testing.assert_array_equal(picked, whole)


@given(framerate=st.integers(1, 120), count=st.integers(1, 400))
def test_frames_that_are_kept_are_those_of_the_reduction(framerate, count):
    numbers = np.arange(count, dtype=np.uint16)
    frames = numbers.view(np.uint8).reshape(count, 2)[:, [0, 1, 0]]
    left = reduce_clip(frames[:, None, None], framerate)[:, 0, 0]
    kept = [index for index in range(count) if is_kept(index, framerate)]
    np.testing.assert_array_equal(left, frames[kept])


@pytest.mark.slow
def test_every_value_of_a_pixel_becomes_the_colour_that_opencv_gives_it():
    planes = np.empty((256, 3, 256, 256), np.uint8)
    steps = np.arange(256, dtype=np.uint8)
    planes[:, 0], planes[:, 1] = steps, steps[:, None]
    planes[:, 2] = steps[:, None, None]
    data = video_of(planes)
    np.testing.assert_array_equal(decode_picked(data, **ALL), decode_mp4(data))


@pytest.mark.slow
def test_pixels_under_the_centres_are_picked_of_pictures_of_any_size():
    for side in (*range(258, 1025, 14), 300, 320, 384, 512, 640, 768, 1000, 1024):
        planes = np.full((1, 3, side, side), 128, np.uint8)
        planes[0, 0] = 16 + np.arange(side) % 211
        planes[0, 1] = 64 + np.arange(side)[:, None] % 127
        data = video_of(planes)
        whole = reduce_clip(decode_mp4(data), 30)
        np.testing.assert_array_equal(decode_picked(data, **ALL), whole)


def test_frames_after_the_last_one_that_is_wanted_are_not_decoded():
    frames = noise(9, 32)
    data = encode_mp4(frames, 30)
    np.testing.assert_array_equal(decode_picked(data, **HALF, stop=5), frames[:5:2])
    np.testing.assert_array_equal(decode_picked(data, **HALF, stop=99), frames[::2])


@pytest.mark.parametrize(
    "kind",
    [{"pixel_format": "yuv420p"}, {"color_range": 2}, {"matrix": 1}],
    ids=lambda kind: next(iter(kind)),
)
def test_a_video_of_another_kind_is_left_to_others(kind):
    assert (
        decode_picked(video_of(np.full((2, 3, 64, 64), 90, np.uint8), **kind), **ALL)
        is None
    )


def test_a_picture_that_is_not_square_is_refused():
    data = encode_mp4(noise(1, 48)[:, :32], 30)
    with pytest.raises(ValueError, match="48 x 32 px, must be square"):
        decode_picked(data, **ALL)


@pytest.mark.parametrize("part", [0.0, 0.3, 0.7, 0.95])
def test_a_truncated_file_is_an_error_and_no_shorter_clip(part):
    data = encode_mp4(noise(20, 64), 30)
    with pytest.raises(ValueError, match="truncated or corrupt; fetch or render"):
        decode_picked(data[: int(part * len(data))], **ALL)
