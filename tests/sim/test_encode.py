"""Encoding is lossless, deterministic, and refuses what it could not keep."""

import io

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpmworlds.sim.run.encode import (
    ColorError,
    decode_mp4,
    encode_mp4,
    frames_sha256,
    iter_mp4,
)
from mpmworlds.sim.scene.palette import PALETTE, rgb

COLORS = np.array([(0, 0, 0), *map(rgb, PALETTE.values())], np.uint8)


def clip(seed=0, frames=5, height=32, width=48):
    """Return noise in palette colours: the worst case for a codec."""
    rng = np.random.default_rng(seed)
    return COLORS[rng.integers(0, len(COLORS), (frames, height, width))]


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    frames=st.integers(1, 4),
    height=st.integers(1, 40),
    width=st.integers(1, 40),
)
def test_decoding_gives_the_frames_back(seed, frames, height, width):
    sent = clip(seed, frames, height, width)
    np.testing.assert_array_equal(decode_mp4(encode_mp4(sent, 30)), sent)


def test_bytes_are_the_same_every_time():
    assert encode_mp4(clip(), 30) == encode_mp4(clip(), 30)


def test_frames_beyond_one_key_frame_interval_are_exact():
    sent = clip(frames=130, height=16, width=16)
    np.testing.assert_array_equal(decode_mp4(encode_mp4(sent, 30)), sent)


def test_views_that_are_not_contiguous_are_encoded_as_seen():
    sent = clip(height=64)[:, ::2, ::-1]
    np.testing.assert_array_equal(decode_mp4(encode_mp4(sent, 30)), sent)


def test_the_stream_is_tagged_and_starts_fast():
    data = encode_mp4(np.repeat(clip(frames=1), 90, axis=0), 15)
    assert data.find(b"moov") < data.find(b"mdat")
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == 15
        assert stream.pix_fmt == "yuv444p"
        assert stream.codec_context.colorspace == 6
        assert stream.codec_context.color_range == 1
        keys = [p.pts for p in container.demux(stream) if p.is_keyframe]
    assert len(keys) == 2


def test_a_colour_that_does_not_survive_is_named_with_its_place_and_remedy():
    frames = clip()
    frames[3, 2, 1] = 250, 10, 3
    with pytest.raises(ColorError) as error:
        encode_mp4(frames, 30)
    for part in ("frame 3", "#FA0A03", "row 2", "column 1", PALETTE["red"], "(red)"):
        assert part in str(error.value)


@pytest.mark.parametrize(
    "frames",
    [
        np.zeros((2, 4, 4), np.uint8),
        np.zeros((2, 4, 4, 4), np.uint8),
        np.zeros((2, 4, 4, 3), np.float32),
        np.zeros((0, 4, 4, 3), np.uint8),
    ],
)
def test_arrays_of_another_form_are_refused(frames):
    with pytest.raises(ValueError, match="frames"):
        encode_mp4(frames, 30)
    with pytest.raises(ValueError, match="frames"):
        frames_sha256(frames)


def test_a_framerate_below_one_is_refused():
    with pytest.raises(ValueError, match="framerate = 0"):
        encode_mp4(clip(), 0)


@pytest.mark.parametrize("data", [b"", b"no video", encode_mp4(clip(), 30)[:800]])
def test_bytes_without_a_video_are_an_error(data):
    with pytest.raises(ValueError, match="no decodable video"):
        decode_mp4(data)


def test_frames_can_be_read_one_at_a_time_and_left_early():
    sent = clip()
    frames = iter_mp4(encode_mp4(sent, 30))
    np.testing.assert_array_equal(next(frames), sent[0])
    frames.close()


def test_the_hash_depends_on_every_value_and_on_the_shape():
    frames = clip()
    changed = frames.copy()
    changed[-1, -1, -1, -1] ^= 1
    hashes = {frames_sha256(f) for f in (frames, changed, frames.swapaxes(1, 2))}
    reshaped = frames.reshape(5, 48, 32, 3)
    assert len(hashes | {frames_sha256(reshaped)}) == 4
    assert frames_sha256(frames[:, ::-1][:, ::-1]) == frames_sha256(frames)
