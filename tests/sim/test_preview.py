"""Previews play everywhere, look like the clip, and are the same bytes every time."""

import hashlib
import io
import os
import subprocess
import sys
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.run.preview import encode_preview, poster
from mpmworlds.sim.scene.palette import PALETTE, rgb

COLOR = rgb(next(iter(PALETTE.values())))
RATE = 15


def ball(count=20, side=64, radius=9):
    """A disc that crosses the picture; the first and the last frame are empty."""
    frames = np.zeros((count, side, side, 3), np.uint8)
    rows, columns = np.mgrid[:side, :side]
    for index in range(1, count - 1):
        centre = side * index // count
        inside = (rows - side // 2) ** 2 + (columns - centre) ** 2 < radius**2
        frames[index, inside] = COLOR
    return frames


def test_stream_is_what_every_browser_plays():
    data = encode_preview(ball(), RATE)
    assert data.find(b"moov") < data.find(b"mdat")
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert stream.average_rate == RATE
        pictures = list(container.decode(video=0))
    assert len(pictures) == 20
    assert [picture.pts * picture.time_base * RATE for picture in pictures] == [
        *range(20)
    ]


def test_preview_looks_like_the_clip():
    frames = ball(side=128, radius=20)
    seen = decode_mp4(encode_preview(frames, RATE))
    assert seen.shape == frames.shape
    assert np.abs(seen.astype(int) - frames).mean() < 2
    inside = cv2.erode(frames[10].any(axis=-1).astype(np.uint8), np.ones((9, 9)))
    middle = np.median(seen[10][inside == 1], axis=0)
    assert np.abs(middle - COLOR).max() <= 3


def test_bytes_are_the_same_every_time():
    assert encode_preview(ball(), RATE) == encode_preview(ball(), RATE)
    assert poster(ball()) == poster(ball())


@pytest.mark.parametrize("fill", ["1", "77", "255"])
def test_bytes_do_not_depend_on_what_memory_held_before(fill):
    program = (
        "import hashlib, sys; sys.path.insert(0, sys.argv[1]);"
        "from test_preview import RATE, ball, encode_preview;"
        "data = [encode_preview(ball(side=side), RATE) for side in (48, 96, 144)];"
        "print(hashlib.sha256(b''.join(data)).hexdigest())"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, str(Path(__file__).parent)],
        env=os.environ | {"MALLOC_PERTURB_": fill},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    here = b"".join(encode_preview(ball(side=side), RATE) for side in (48, 96, 144))
    assert run.stdout.strip() == hashlib.sha256(here).hexdigest()


def test_views_are_encoded_as_seen():
    frames = ball(side=96)
    view = frames[::2, ::-1, ::-1]
    assert encode_preview(view, RATE) == encode_preview(view.copy(), RATE)


def test_odd_sides_are_extended_by_a_pixel():
    assert decode_mp4(encode_preview(ball(side=33), RATE)).shape[1:3] == (34, 34)


def test_poster_shows_what_happens_between_an_empty_start_and_end():
    shown = cv2.imdecode(np.frombuffer(poster(ball()), np.uint8), cv2.IMREAD_COLOR)
    picture = cv2.cvtColor(shown, cv2.COLOR_BGR2RGB)
    assert any((picture == frame).all() for frame in ball())
    assert (picture == COLOR).all(axis=-1).sum() > 200


def test_poster_of_a_clip_in_which_nothing_moves_is_its_frame():
    still = np.repeat(ball()[10:11], 5, axis=0)
    shown = cv2.imdecode(np.frombuffer(poster(still), np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(cv2.cvtColor(shown, cv2.COLOR_BGR2RGB), still[0])


@pytest.mark.parametrize("make", [lambda f: encode_preview(f, RATE), poster])
@pytest.mark.parametrize(
    "frames",
    [
        np.zeros((2, 8, 8), np.uint8),
        np.zeros((0, 8, 8, 3), np.uint8),
        np.zeros((2, 8, 8, 3)),
    ],
    ids=["grey", "empty", "float"],
)
def test_what_is_no_clip_is_refused(make, frames):
    with pytest.raises(ValueError, match="frames"):
        make(frames)


def test_frame_rate_must_be_positive():
    with pytest.raises(ValueError, match="framerate = 0, must be at least 1"):
        encode_preview(ball(), 0)
