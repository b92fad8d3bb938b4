"""The palette is exact through the real codec, whichever decoder reads it."""

import io
import subprocess
import sys
from itertools import combinations, pairwise

import av
import numpy as np
import pytest

from mpmworlds.sim.run.encode import decode_mp4, encode_mp4
from mpmworlds.sim.scene.palette import (
    BACKGROUND,
    PALETTE,
    hue_deg,
    is_exact,
    name_of,
    nearest,
    rgb,
    saturation,
)

COLORS = np.array([rgb(BACKGROUND), *map(rgb, PALETTE.values())], np.uint8)


def decode_with_pyav(data):
    with av.open(io.BytesIO(data)) as container:
        return np.stack(
            [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        )


@pytest.mark.parametrize("size", [(64, 64), (66, 101)])
def test_every_colour_survives_the_codec_in_both_decoders(size):
    stripes = np.arange(np.prod(size)).reshape(size) // 3
    frames = COLORS[np.stack([stripes, stripes * 7]) % len(COLORS)]
    assert len(np.unique(frames.reshape(-1, 3), axis=0)) == len(COLORS)
    data = encode_mp4(frames, 30)
    np.testing.assert_array_equal(decode_mp4(data), frames)
    np.testing.assert_array_equal(decode_with_pyav(data), frames)


def test_every_colour_stands_out_from_the_background():
    assert all(max(rgb(color)) >= 128 for color in PALETTE.values())


def test_names_and_colours_are_distinct():
    assert len(set(PALETTE.values())) == len(PALETTE)


@pytest.mark.parametrize("prefix", ["", "deep_"])
def test_hues_of_a_row_are_evenly_spaced(prefix):
    names = list(PALETTE)[:24]
    hues = [hue_deg(PALETTE[prefix + name]) for name in names]
    steps = [(b - a) % 360 for a, b in pairwise([*hues, hues[0]])]
    assert all(abs(step - 15) < 1.5 for step in steps)


def test_exactness_ignores_letter_case():
    assert is_exact(PALETTE["sky"].lower())
    assert not is_exact("#123456")


def test_nearest_of_a_palette_colour_is_itself():
    assert all(nearest(color) == color for color in PALETTE.values())


def test_nearest_has_the_least_distance():
    wanted = (250, 100, 50)
    best = np.abs(np.array(rgb(nearest("#FA6432"))) - wanted)
    for color in PALETTE.values():
        assert (best**2).sum() <= ((np.array(rgb(color)) - wanted) ** 2).sum()


def test_name_of_reads_back_every_name():
    assert [name_of(color) for color in PALETTE.values()] == list(PALETTE)


def test_colours_of_the_palette_are_far_apart():
    distances = [np.abs(a - b).max() for a, b in combinations(COLORS.astype(int), 2)]
    assert min(distances) >= 30


@pytest.mark.parametrize("text", ["red", "#12345", "#1234567", "123456", "#12345G", ""])
def test_other_notations_are_refused(text):
    with pytest.raises(ValueError, match="must be '#' and six hexadecimal digits"):
        nearest(text)


def test_hue_and_saturation_of_known_colours():
    assert hue_deg("#00FF00") == pytest.approx(120)
    assert saturation("#00FF00") == 1
    assert saturation("#969696") == 0


def test_importing_the_palette_loads_no_codec():
    program = (
        "import sys, mpmworlds.sim.scene.palette;"
        "sys.exit(bool({'av', 'cv2', 'numpy'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
