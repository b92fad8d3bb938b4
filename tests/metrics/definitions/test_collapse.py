"""Loss of visible area."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mpmworlds.metrics import collapse, collapse_excess, collapsed_share
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.definitions.collapse import curve, excess_curve

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)
# Neighbours in a row merge, the ends of a row do not, the rows never.
COLOURS = [
    *[RED, (247, 8, 0), (239, 16, 0)],
    *[(0, 255, 0), (0, 220, 0), (0, 185, 0), (0, 40, 0)],
    *[(0, 0, 255), (14, 0, 255)],
]
BOX = st.tuples(
    *(st.integers(0, 12) for _ in range(2)),
    *(st.integers(4, 9) for _ in range(2)),
    st.sampled_from(COLOURS),
)
FRAMES = st.lists(st.tuples(BOX, BOX, BOX, BOX), min_size=1, max_size=3)
Box = tuple[int, int, int, int, tuple[int, int, int]]
Feature = tuple[float, ...]


def boxes(frame: tuple[Box, ...]) -> Clip:
    """Paint four boxes, which may touch and cover each other, on 20 x 20 px."""
    image = np.zeros((20, 20, 3), dtype=np.uint8)
    for y, x, height, width, colour in frame:
        image[y : y + height, x : x + width] = colour
    return image


def two_bodies(count: int = 3) -> Clip:
    """Paint a red 10 x 10 and a blue 6 x 6 box, apart, in every frame."""
    clip = np.zeros((count, 32, 32, 3), dtype=np.uint8)
    clip[:, 2:12, 2:12] = RED
    clip[:, 20:26, 20:26] = BLUE
    return clip


def feature(colour: list[int]) -> Feature:
    return (*(c / sum(colour) for c in colour), max(colour) / 255)


def distances(a: Feature, b: Feature) -> tuple[float, float]:
    chroma = sum((p - q) ** 2 for p, q in zip(a[:3], b[:3], strict=True)) ** 0.5
    return chroma, abs(a[3] - b[3])


def mean(features: list[Feature]) -> Feature:
    return tuple(sum(v) / len(features) for v in zip(*features, strict=True))


def counts(a: Feature, b: Feature) -> bool:
    chroma, brightness = distances(a, b)
    return chroma <= 0.05 and brightness <= 0.25


def similar(a: Feature, b: Feature) -> bool:
    chroma, brightness = distances(a, b)
    return chroma < 0.05 and brightness < 0.15


def smoothed(image: Clip) -> list[list[list[int]]]:
    """Median of the 3 x 3 pixels around each, the outermost repeated."""
    edge = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge").tolist()
    around = [(j, i) for j in range(3) for i in range(3)]
    height, width, _ = image.shape
    return [
        [
            [sorted(edge[y + j][x + i][c] for j, i in around)[4] for c in range(3)]
            for x in range(width)
        ]
        for y in range(height)
    ]


def pieces(part: set[tuple[int, int]]) -> list[set[tuple[int, int]]]:
    """The 8-connected components of pixels, by flood fill."""
    todo, found = set(part), []
    while todo:
        stack, piece = [todo.pop()], set()
        while stack:
            y, x = stack.pop()
            piece.add((y, x))
            near = {(y + j, x + i) for j in (-1, 0, 1) for i in (-1, 0, 1)} & todo
            todo -= near
            stack.extend(near)
        found.append(piece)
    return found


def core(kept: set[tuple[int, int]], side: int) -> int:
    """Pixels whose neighbours in the image all belong to the part."""
    inside = {(y, x) for y in range(side) for x in range(side)}
    return sum(
        ({(y + j, x + i) for j in (-1, 0, 1) for i in (-1, 0, 1)} & inside) <= kept
        for y, x in kept
    )


def parts_of(image: Clip) -> list[list[Feature]]:
    """Features of the pixels of each part, pixel by pixel."""
    smooth = smoothed(image)
    left = {
        (y, x): colour
        for y, row in enumerate(smooth)
        for x, colour in enumerate(row)
        if max(colour) > 32
    }
    found = []
    while left:
        bins: dict[tuple[int, ...], list[tuple[int, int]]] = {}
        for place, colour in left.items():
            bins.setdefault(tuple(c // 16 for c in colour), []).append(place)
        fullest = max(sorted(bins), key=lambda b: len(bins[b]))
        centre = mean([feature(left[place]) for place in bins[fullest]])
        part = {p for p, c in left.items() if counts(feature(c), centre)}
        part |= set(bins[fullest])
        kept = set().union(*(p for p in pieces(part) if len(p) >= 25))
        if core(kept, len(image)) >= 9:
            found.append([feature(left[place]) for place in sorted(kept)])
        left = {p: c for p, c in left.items() if p not in part}
    return found


def lost(clip: Clip) -> float:
    """The score, pixel by pixel."""
    merged: list[list[list[Feature]]] = []
    for part in parts_of(clip[0]):
        linked = [g for g in merged if any(similar(mean(part), mean(o)) for o in g)]
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
            areas.append(sum(counts(feature(c), centre) for c in pixels))
        first = areas[0]
        losses.extend(max(0.0, 1 - a / first) if first else 1.0 for a in areas)
    return max(losses)


@settings(max_examples=40, deadline=None)
@given(frames=FRAMES)
def test_loss_agrees_with_flood_fill_and_pixel_loops(
    frames: list[tuple[Box, ...]],
) -> None:
    clip = np.stack([boxes(frame) for frame in frames])
    assert collapse(clip) == pytest.approx(lost(clip), abs=1e-12)


@settings(max_examples=10, deadline=None)
@given(frames=FRAMES, seed=st.integers(0, 99))
def test_loss_of_noisy_clips_agrees_with_pixel_loops(
    frames: list[tuple[Box, ...]], seed: int
) -> None:
    flat = np.stack([boxes(frame) for frame in frames]).astype(np.int64)
    noise = np.random.default_rng(seed).normal(0.0, 8.0, flat.shape).round()
    clip = (flat + noise.astype(np.int64)).clip(0, 255).astype(np.uint8)
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
    clip[0, 8:12, 8:17] = RED  # a median takes its corners: 32 px, a core of 10
    assert collapse(clip) == 0.0
    clip[0, 8:12, 8:17] = 0
    clip[0, 8:12, 8:15] = RED  # 24 px
    assert collapse(clip) == 1.0


def test_fringe_without_a_core_is_no_region() -> None:
    clip = np.zeros((2, 32, 32, 3), dtype=np.uint8)
    clip[:, 2:5, 2:22] = RED  # 54 px after the median, 16 of them its core
    assert collapse(clip) == 0.0
    clip[:, 2:5, 2:22] = 0
    clip[:, 2:4, 2:32] = RED  # the median leaves 56 px, two wide
    assert collapse(clip) == 1.0


def test_single_frame_loses_nothing_unless_it_has_no_region() -> None:
    assert collapse(two_bodies(1)) == 0.0
    assert collapse(np.zeros((1, 32, 32, 3), dtype=np.uint8)) == 1.0


def test_diagonal_neighbours_are_one_piece() -> None:
    clip = np.zeros((2, 32, 32, 3), dtype=np.uint8)
    for k in (2, 7, 12):  # squares of 5 x 5 px, of which a median leaves 21
        clip[:, k : k + 5, k : k + 5] = RED
    clip[1, 12:17, 12:17] = 0
    assert collapse(clip) == pytest.approx(1 / 3)


def test_noise_and_speckle_of_single_pixels_are_no_regions() -> None:
    clip = two_bodies()
    clip[0, ::3, ::3] = GREEN
    assert collapse(clip) < 0.5


def test_fringes_of_an_outline_are_not_followed() -> None:
    clip = two_bodies()
    clip[0, 2:12, 12] = (120, 60, 0)  # as a codec leaves them
    clip[0, 2:12, 1] = (60, 80, 90)
    assert collapse(clip) == 0.0


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


def test_part_that_shades_pull_near_to_another_is_one_region_with_it() -> None:
    clip = np.zeros((2, 40, 40, 3), dtype=np.uint8)
    clip[:, 2:12, 2:12] = (0, 255, 0)
    clip[:, 2:12, 14:23] = (0, 209, 0)  # two shades that the green takes with it
    clip[:, 2:12, 25:34] = (0, 196, 0)
    clip[:, 20:26, 2:8] = (0, 185, 0)  # too dark for that, but not for their mean
    clip[1, 20:26, 2:8] = 0
    assert collapse(clip) == pytest.approx(36 / (100 + 90 + 90 + 36))
    clip[:, 2:12, 14:34] = 0
    assert collapse(clip) == 1.0


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


def test_excess_is_what_the_prediction_loses_beyond_the_truth() -> None:
    pred, ref = two_bodies(4), two_bodies(4)
    pred[1, 20:26, 20:26] = 0  # blue is lost at t = 1, and back
    ref[2:, 2:7, 2:12] = 0  # half of red leaves
    assert collapse_excess(pred, ref) == pytest.approx(0.5)
    assert excess_curve(pred, ref).tolist() == pytest.approx([0.0, 1.0, 0.5, 0.5])
    assert collapse_excess(ref, pred) == 0.0


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
