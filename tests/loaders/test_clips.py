"""Clips of rows: reduced while they are decoded, whole or their prefix, or sampled."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.loaders.clips import Clip, clip_of, decode_reduced, sampled
from mpmworlds.loaders.load import load
from mpmworlds.metrics.reduction import prefix_length, reduce_clip
from mpmworlds.sim.run.encode import encode_mp4
from tests.sim.clips import noise, video_of


def numbered(count, framerate=15):
    """A clip whose frames hold their own number."""
    frames = np.zeros((count, 2, 2, 3), np.uint8)
    frames[:] = np.arange(count, dtype=np.uint8)[:, None, None, None]
    return Clip(frames, framerate)


def row_with(video=None, clip=None, framerate=30):
    columns = {"video": video, "clip": clip}
    files = {name: data and {"bytes": data} for name, data in columns.items()}
    return {"id": "p0007", "framerate": framerate} | files


def test_a_clip_that_is_reduced_already_is_read_instead_of_the_video():
    frames = noise(200, 16)
    reduced = reduce_clip(frames, 30)
    row = row_with(b"not looked at", encode_mp4(reduced, 15))
    for prefix_only, length in ((False, 100), (True, 38)):
        clip = clip_of(row, prefix_only=prefix_only)
        assert clip.framerate == 15
        np.testing.assert_array_equal(clip.frames, reduced[:length])


@pytest.mark.parametrize("framerate", [2, 15, 24, 30])
def test_a_prefix_is_the_start_of_the_clip(framerate):
    row = row_with(encode_mp4(noise(3 * framerate, 16), framerate), None, framerate)
    whole = clip_of(row)
    prefix = clip_of(row, prefix_only=True)
    assert prefix.framerate == whole.framerate == min(framerate, 15)
    length = prefix_length(whole.framerate)
    np.testing.assert_array_equal(prefix.frames, whole.frames[:length])


def test_videos_of_other_makes_are_reduced_as_well():
    data = video_of(np.full((90, 3, 64, 64), 128, np.uint8), "yuv420p")
    assert decode_reduced(data, 30).shape == (45, 64, 64, 3)
    assert decode_reduced(data, 30, prefix_only=True).shape == (38, 64, 64, 3)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (row_with(), "p0007: has no video; load another"),
        (row_with(b"nothing"), "p0007: 7 bytes hold no decodable video"),
        (row_with(b"nothing", framerate=0), "p0007: framerate = 0, must be at least 1"),
    ],
    ids=["no video", "damaged", "no rate"],
)
def test_a_row_that_cannot_be_read_is_named(row, message):
    with pytest.raises(ValueError, match=message):
        clip_of(row)


@given(count=st.integers(1, 200), n=st.integers(2, 40))
def test_sampled_frames_are_spread_evenly_from_first_to_last(count, n):
    clip = numbered(count)
    stills = sampled(clip, n)
    numbers = stills.frames[:, 0, 0, 0].astype(int)
    assert len(numbers) == min(n, count)
    assert (numbers[0], numbers[-1]) == (0, count - 1)
    gaps = np.diff(numbers)
    assert (gaps >= 1).all() and (count <= n or np.ptp(gaps) <= 1)
    np.testing.assert_array_equal(stills.seconds, numbers / 15)


def test_less_than_two_sampled_frames_are_refused():
    with pytest.raises(ValueError, match="n = 1 frames, must be at least 2"):
        sampled(numbered(9), 1)


def test_an_example_samples_its_prefix(release):
    example = load(release)[0]
    stills = example.sampled_prefix(3)
    assert stills.seconds == (0.0, 1.5, 2.5)
    np.testing.assert_array_equal(stills.frames, example.prefix[[0, 3, 5]])
