"""Loss of visible area."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpmworlds.metrics import collapse, collapsed_share
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.collapse import curve

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)
# Neighbours in a row merge, the ends of a row do not, the rows never.
COLOURS = [
    *[RED, (247, 8, 0), (239, 16, 0)],
    *[(0, 255, 0), (0, 220, 0), (0, 185, 0), (0, 40, 0)],
    *[(0, 0, 255), (14, 0, 255)],
]
BOX = st.tuples(st.integers(1, 8), st.integers(1, 8), st.sampled_from(COLOURS))
FRAMES = st.lists(st.tuples(BOX, BOX, BOX, BOX), min_size=1, max_size=4)


def boxes(frame: tuple[tuple[int, int, tuple[int, int, int]], ...]) -> Clip:
    """Paint four boxes that never touch on 20 x 20 px."""
    image = np.zeros((20, 20, 3), dtype=np.uint8)
    corners = [(0, 0), (0, 10), (10, 0), (10, 10)]
    for (y, x), (height, width, colour) in zip(corners, frame, strict=True):
        image[y : y + height, x : x + width] = colour
    return image


def two_bodies(count: int = 3) -> Clip:
    """Paint a red 10 x 10 and a blue 6 x 6 box, apart, in every frame."""
    clip = np.zeros((count, 32, 32, 3), dtype=np.uint8)
    clip[:, 2:12, 2:12] = RED
    clip[:, 20:26, 20:26] = BLUE
    return clip


def feature(colour: list[int]) -> tuple[float, ...]:
    return (*(c / sum(colour) for c in colour), max(colour) / 255)


def distances(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, float]:
    chroma = sum((p - q) ** 2 for p, q in zip(a[:3], b[:3], strict=True)) ** 0.5
    return chroma, abs(a[3] - b[3])


def mean(features: list[tuple[float, ...]]) -> tuple[float, ...]:
    return tuple(sum(v) / len(features) for v in zip(*features, strict=True))


def similar(a: list[tuple[float, ...]], b: list[tuple[float, ...]]) -> bool:
    chroma, brightness = distances(mean(a), mean(b))
    return chroma < 0.05 and brightness < 0.15


def flooded(image: Clip) -> list[list[tuple[float, ...]]]:
    """Collect the features of each 8-connected component by flood fill."""
    todo = {(y, x) for y, x in np.argwhere(image.max(axis=2) > 32).tolist()}
    components = []
    while todo:
        stack, found = [todo.pop()], []
        while stack:
            y, x = stack.pop()
            found.append(feature(image[y, x].tolist()))
            near = {(y + j, x + i) for j in (-1, 0, 1) for i in (-1, 0, 1)} & todo
            todo -= near
            stack.extend(near)
        components.append(found)
    return components


def lost(clip: Clip) -> float:
    """Compute the score pixel by pixel, for components of one colour each."""
    merged: list[list[list[tuple[float, ...]]]] = []
    for part in (c for c in flooded(clip[0]) if len(c) >= 25):
        linked = [g for g in merged if any(similar(part, other) for other in g)]
        merged = [g for g in merged if g not in linked]
        merged.append([part, *(other for group in linked for other in group)])
    if not merged:
        return 1.0
    losses = [0.0]
    for group in merged:
        centre = mean([f for part in group for f in part])
        areas = []
        for image in clip:
            pixels = [c for c in image.reshape(-1, 3).tolist() if max(c) > 32]
            near = [distances(feature(c), centre) for c in pixels]
            areas.append(sum(a <= 0.05 and b <= 0.25 for a, b in near))
        losses.extend(max(0.0, 1 - a / areas[0]) for a in areas[1:])
    return max(losses)


@settings(max_examples=100, deadline=None)
@given(frames=FRAMES)
def test_loss_agrees_with_flood_fill_and_pixel_loops(
    frames: list[tuple[tuple[int, int, tuple[int, int, int]], ...]],
) -> None:
    clip = np.stack([boxes(frame) for frame in frames])
    assert collapse(clip) == pytest.approx(lost(clip), abs=1e-12)


def test_still_clip_loses_nothing() -> None:
    assert collapse(two_bodies()) == 0.0
    assert curve(two_bodies()).tolist() == [0.0, 0.0, 0.0]


def test_loss_is_that_of_the_worst_body_at_the_worst_time() -> None:
    clip = two_bodies(4)
    clip[1, 2:4, 2:12] = 0  # red loses 20 of 100
    clip[2, 20:23, 20:26] = 0  # blue loses 18 of 36
    assert curve(clip).tolist() == pytest.approx([0.0, 0.2, 0.5, 0.0])
    assert collapse(clip) == 0.5


def test_body_that_vanishes_is_a_full_loss() -> None:
    clip = two_bodies()
    clip[2, 20:26, 20:26] = 0
    assert collapse(clip) == 1.0


def test_growth_is_no_loss() -> None:
    clip = two_bodies()
    clip[1:, 14:18, :] = RED
    assert collapse(clip) == 0.0


@settings(max_examples=20, deadline=None)
@given(shift=st.tuples(st.integers(0, 31), st.integers(0, 31)))
def test_motion_without_change_of_area_is_no_loss(shift: tuple[int, int]) -> None:
    clip = two_bodies()
    clip[1] = np.roll(clip[1], shift, axis=(0, 1))
    assert collapse(clip) == 0.0


def test_scattering_into_small_pieces_is_no_loss() -> None:
    clip = two_bodies()
    clip[1:] = 0
    clip[1:, ::2, ::2][:, :10, :10] = RED
    clip[1:, 1::2, ::2][:, :6, :6] = BLUE
    assert collapse(clip) == 0.0


def test_clip_without_region_in_its_first_frame_is_a_full_loss() -> None:
    clip = two_bodies()
    clip[0] = 0
    assert collapse(clip) == 1.0
    assert curve(clip).tolist() == [1.0, 1.0, 1.0]
    clip[0, :4, :6] = RED  # 24 px
    assert collapse(clip) == 1.0
    clip[0, 4, 0] = RED  # 25 px
    assert collapse(clip) == 0.0


def test_single_frame_loses_nothing_unless_it_has_no_region() -> None:
    assert collapse(two_bodies(1)) == 0.0
    assert collapse(np.zeros((1, 32, 32, 3), dtype=np.uint8)) == 1.0


def test_diagonal_neighbours_are_one_region() -> None:
    clip = np.zeros((2, 32, 32, 3), dtype=np.uint8)
    clip[0, range(25), range(25)] = RED
    assert collapse(clip) == 1.0
    clip[1, range(20), range(20)] = RED
    assert collapse(clip) == pytest.approx(0.2)


def test_bodies_of_one_colour_share_their_area() -> None:
    clip = np.zeros((2, 32, 32, 3), dtype=np.uint8)
    clip[:, 2:12, 2:12] = RED
    clip[0, 20:26, 20:26] = RED
    assert collapse(clip) == pytest.approx(36 / 136)


def test_speck_of_another_colour_is_not_followed() -> None:
    clip = two_bodies()
    clip[0, 14:18, 14:18] = GREEN
    assert collapse(clip) == 0.0


def test_dimming_within_a_quarter_is_no_loss_and_beyond_is() -> None:
    clip = two_bodies()
    clip[1:, 2:12, 2:12] = (255 - 63, 0, 0)
    assert collapse(clip) == 0.0
    clip[1:, 2:12, 2:12] = (255 - 64, 0, 0)
    assert collapse(clip) == 1.0


def test_change_of_hue_within_tolerance_is_no_loss_and_beyond_is() -> None:
    clip = two_bodies()
    clip[1:, 2:12, 2:12] = (247, 8, 0)  # chromaticity moves by 0.044
    assert collapse(clip) == 0.0
    clip[1:, 2:12, 2:12] = (245, 10, 0)  # by 0.055
    assert collapse(clip) == 1.0


def test_bodies_merge_by_way_of_a_colour_between_them() -> None:
    clip = np.zeros((2, 32, 32, 3), dtype=np.uint8)
    for x, colour in ((0, RED), (10, (247, 8, 0)), (20, (239, 16, 0))):
        clip[:, :5, x : x + 5] = colour
    clip[1, :5, 20:25] = 0
    assert collapse(clip) == pytest.approx(1 / 3)


def test_touching_bodies_of_different_colour_are_followed_apart() -> None:
    clip = np.zeros((3, 32, 32, 3), dtype=np.uint8)
    clip[:, 10:20, 0:10] = RED
    clip[:, 10:20, 10:16] = BLUE
    assert collapse(clip) == 0.0
    clip[2, 10:13, 10:16] = 0
    assert curve(clip).tolist() == pytest.approx([0.0, 0.0, 0.3])


def test_touching_specks_of_different_colours_are_no_region() -> None:
    clip = np.zeros((2, 8, 8, 3), dtype=np.uint8)
    clip[:, :4, :4] = RED
    clip[:, :4, 4:8] = BLUE
    assert collapse(clip) == 1.0


def test_parts_of_one_colour_in_different_heaps_are_one_region() -> None:
    clip = np.zeros((2, 40, 40, 3), dtype=np.uint8)
    for y in (0, 20):
        clip[:, y : y + 10, 0:10] = RED
        clip[:, y : y + 10, 10:16] = BLUE
    clip[1, 0:10, 10:16] = 0
    assert collapse(clip) == 0.5


def test_collapsed_share_counts_the_first_event_of_each_sample() -> None:
    curves = [
        np.array([0.0, 0.6, 0.0, 0.0]),
        np.array([0.0, 0.5, 0.5, 0.9]),
        np.array([0.0, 0.0, 0.0, 0.0]),
        np.array([1.0, 1.0, 1.0, 1.0]),
    ]
    share = collapsed_share(curves)
    assert share.tolist() == [0.25, 0.5, 0.5, 0.75]
    assert all(a <= b for a, b in pairwise(share))


@pytest.mark.parametrize("curves", [[], [np.zeros(3), np.zeros(4)]])
def test_collapsed_share_refuses_curves_without_a_common_length(
    curves: list[np.ndarray[tuple[int], np.dtype[np.float64]]],
) -> None:
    with pytest.raises(ValueError, match=r"lengths \[.*\], must be one common"):
        collapsed_share(curves)
