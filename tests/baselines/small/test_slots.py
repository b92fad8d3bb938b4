"""Frames as labels of the colours of a prefix, and back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.baselines.simple.codec import through_codec
from mpmworlds.baselines.small.slots import CLASSES, SLOTS, UNKNOWN, Slots, shuffled
from mpmworlds.sim.scene.palette import PALETTE, rgb

COLORS = list(PALETTE.values())


def clip_of(colors, frames=3, side=32):
    """Stripes of colours, each one pixel row narrower than the one before."""
    clip = np.zeros((frames, side, side, 3), np.uint8)
    for number, color in enumerate(colors):
        clip[:, number, : side - number] = rgb(color)
    return clip


@given(st.lists(st.sampled_from(COLORS), min_size=1, max_size=SLOTS, unique=True))
def test_labels_keep_all_that_frames_show(colors):
    clip = clip_of(colors)
    slots = Slots.of(clip)
    labels = slots.labels(clip)
    np.testing.assert_array_equal(slots.frames(labels), clip)
    assert slots.colors == tuple(colors)  # the largest first
    assert labels.max() < CLASSES


def test_of_too_many_colors_the_largest_are_kept():
    clip = clip_of(COLORS[: SLOTS + 2])
    slots = Slots.of(clip)
    assert slots.colors == tuple(COLORS[:SLOTS])
    labels = slots.labels(clip)
    assert (labels[:, SLOTS : SLOTS + 2, : 32 - SLOTS - 1] == UNKNOWN).all()
    assert not slots.frames(labels)[:, SLOTS:].any()


def test_a_color_that_comes_later_is_unknown():
    slots = Slots.of(clip_of(COLORS[:1]))
    assert (slots.labels(clip_of(COLORS[1:2]))[:, 0] == UNKNOWN).all()


def test_an_empty_prefix_has_background_alone():
    clip = np.zeros((3, 32, 32, 3), np.uint8)
    slots = Slots.of(clip)
    assert slots.colors == ()
    assert not slots.labels(clip).any()


def test_a_recompressed_prefix_has_the_same_colors():
    clip = np.zeros((4, 64, 64, 3), np.uint8)
    clip[:, 8:24, 8:24], clip[:, 32:56, 20:60] = rgb(COLORS[3]), rgb(COLORS[30])
    lossy = through_codec(clip, 15, 23)
    assert (lossy != clip).any()
    assert set(Slots.of(lossy).colors) == {COLORS[3], COLORS[30]}


@pytest.mark.parametrize("order", [np.arange(1, CLASSES), np.arange(SLOTS, 0, -1)])
def test_shuffling_moves_slots_and_nothing_else(order):
    labels = np.array([0, *range(1, CLASSES), UNKNOWN], np.uint8)
    found = shuffled(labels, order)
    assert found.tolist() == [0, *order, UNKNOWN]
