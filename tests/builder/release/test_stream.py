"""Frames that come one at a time are those that come all at once."""

import numpy as np
import pytest

from mpmworlds.builder.release.checks.stream import frames_of
from mpmworlds.builder.release.checks.videos import preview_faults, video_faults
from mpmworlds.metrics.reduction import reduce_clip, reduced_framerate
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4, frames_sha256
from mpmworlds.sim.run.preview import encode_preview, poster
from mpmworlds.sim.scene.palette import PALETTE, rgb

COLORS = np.array([rgb(color) for color in PALETTE.values()], np.uint8)


def clip_of(side, count=7):
    chosen = np.random.default_rng(side).integers(len(COLORS), size=(count, side, side))
    return COLORS[chosen]


@pytest.mark.parametrize("encode", [encode_mp4, encode_preview])
@pytest.mark.parametrize("side", [64, 98])
def test_frames_are_those_of_the_whole_clip(encode, side):
    data = encode(clip_of(side), 30)
    whole = decode_mp4(data)
    for frame, expected in zip(frames_of(data), whole, strict=True):
        assert (frame == expected).all()


@pytest.mark.parametrize("data", [b"", b"nothing", encode_mp4(clip_of(64), 30)[:900]])
def test_what_cannot_be_decoded_is_an_error(data):
    with pytest.raises(ValueError, match="no decodable video"):
        list(frames_of(data))


def row_of(frames, clip, rate):
    return {
        "num_frames": len(frames),
        "resolution": frames.shape[1],
        "framerate": rate,
        "video": {"bytes": encode_mp4(frames, rate)},
        "clip": {"bytes": encode_mp4(clip, reduced_framerate(rate))},
        "frames_sha256": frames_sha256(frames),
    }


@pytest.mark.parametrize(("side", "rate"), [(64, 30), (300, 30), (512, 20), (64, 10)])
def test_a_pixel_that_is_changed_is_found_in_any_reduction(side, rate):
    frames = clip_of(side)
    clip = reduce_clip(frames, rate)
    assert list(video_faults(row_of(frames, clip, rate))) == []
    wrong = clip.copy()
    wrong[-1, 3, 5] = COLORS[(wrong[-1, 3, 5] == COLORS).all(axis=-1).argmin()]
    found = list(video_faults(row_of(frames, wrong, rate)))
    assert found == ["its clip is not its video reduced"]
    late = row_of(frames, clip, rate) | {"frames_sha256": frames_sha256(frames[::-1])}
    (fault,) = video_faults(late)
    assert "frames_sha256" in fault


def test_a_preview_of_mixed_drops_is_close_enough_and_another_is_not():
    drawn = np.random.default_rng(0).random((9, 256, 256))
    clip = np.zeros((9, 256, 256, 3), np.uint8)
    clip[drawn < 0.06], clip[drawn > 0.94] = COLORS[0], COLORS[1]
    clip[:, :60] = 0
    row = {"preview": {"bytes": encode_preview(clip, 15)}}
    row["poster"] = {"bytes": poster(clip)}
    rendered = row_of(np.zeros((17, 512, 512, 3), np.uint8), clip, 30)
    assert list(preview_faults(row, rendered)) == []
    row["preview"] = {"bytes": encode_preview(clip[:, ::-1].copy(), 15)}
    (fault,) = preview_faults(row, rendered)
    assert "apart from its clip" in fault
