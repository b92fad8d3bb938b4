"""Frames on the canvas of a model."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.baselines.vdm.canvas import Canvas

SIDES = st.integers(1, 70)


def noise(height, width):
    levels = np.random.default_rng(0).integers(0, 256, (2, height, width, 3))
    return levels.astype(np.uint8)


@given(SIDES, SIDES, st.sampled_from([1, 8, 16]))
def test_any_size_comes_back_exactly(height, width, multiple):
    canvas = Canvas(height, width, multiple)
    frames = noise(height, width)
    on = canvas.put(frames)
    assert on.shape[1] % multiple == on.shape[2] % multiple == 0
    assert np.array_equal(canvas.take(on), frames)


@pytest.mark.parametrize("factor", [2, 3])
def test_a_whole_factor_comes_back_exactly(factor):
    frames = noise(16, 16)
    canvas = Canvas(16, 16, 16, 16 * factor)
    on = canvas.put(frames)
    assert on.shape == (2, 16 * factor, 16 * factor, 3)
    assert np.array_equal(canvas.take(on), frames)


@given(SIDES, SIDES, st.sampled_from([16, 32, 48]))
def test_another_size_keeps_the_shape(height, width, size):
    canvas = Canvas(height, width, 16, size)
    on = canvas.put(noise(height, width))
    assert on.shape[1:3] == canvas.shape
    assert min(canvas.resized) == size
    assert canvas.take(on).shape == (2, height, width, 3)


def test_a_size_that_is_no_multiple_is_told():
    with pytest.raises(ValueError, match="size = 250 px, must be a multiple of 16, as"):
        Canvas(256, 256, 16, 250)
