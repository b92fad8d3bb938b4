"""Where and when clips move."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mpmworlds.metrics import wmae
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.definitions.wmae import curve

LEVELS = st.sampled_from([0, 10, 24, 25, 100, 255])
CLIPS = st.integers(1, 12).flatmap(
    lambda count: st.tuples(
        arrays(np.uint8, (count, 5, 6, 3), elements=LEVELS),
        arrays(np.uint8, (count, 5, 6, 3), elements=LEVELS),
    )
)


def still(count: int, level: int = 0) -> Clip:
    return np.full((count, 8, 8, 3), level, dtype=np.uint8)


def smoothed_activity(clip: Clip) -> list[list[float]]:
    """Compute A(t, r) by loops over tiles, frames and pixels."""
    count, height, width, _ = clip.shape
    luma = clip.astype(int) @ [299, 587, 114]
    raw = []
    for t in range(count - 1):
        tiles = []
        for i in range(4):
            for j in range(4):
                rows = range(i * height // 4, (i + 1) * height // 4)
                columns = range(j * width // 4, (j + 1) * width // 4)
                changes = [
                    abs(int(luma[t + 1, y, x]) - int(luma[t, y, x]))
                    for y in rows
                    for x in columns
                ]
                seen = sum(change for change in changes if change > 24_000)
                tiles.append(seen / 255_000 / len(changes))
        raw.append(tiles)
    smooth = []
    for t in range(len(raw)):
        window = [raw[k] for k in range(t - 4, t + 4) if 0 <= k < len(raw)]
        smooth.append(
            [sum(column) / len(window) for column in zip(*window, strict=True)]
        )
    return smooth


@settings(max_examples=40, deadline=None)
@given(clips=CLIPS)
def test_distance_agrees_with_loops_over_pixels(clips: tuple[Clip, Clip]) -> None:
    a_p, a_r = (smoothed_activity(clip) for clip in clips)
    pairs = list(zip(a_p, a_r, strict=True))
    differences = [sum(abs(u - v) for u, v in zip(p, r, strict=True)) for p, r in pairs]
    totals = [sum(p) + sum(r) for p, r in pairs]
    moving = [d / (s + 1e-8) for d, s in zip(differences, totals, strict=True)]
    assert curve(*clips).tolist() == pytest.approx(moving, abs=1e-7)
    whole = sum(differences) / (sum(totals) + 1e-8)
    assert wmae(*clips) == pytest.approx(whole, abs=1e-7)


def test_two_still_clips_agree_whatever_they_show() -> None:
    assert wmae(still(5), still(5, level=200)) == 0.0
    assert curve(still(5), still(5, level=200)).tolist() == [0.0] * 4


def test_single_frames_have_no_motion_to_compare() -> None:
    assert wmae(still(1), still(1, level=200)) == 0.0
    assert curve(still(1), still(1)).shape == (0,)


def test_still_prediction_of_a_moving_clip_is_farthest() -> None:
    moving = still(5)
    moving[2:] = 255
    assert wmae(still(5), moving) == pytest.approx(1.0)


def test_motion_in_another_tile_is_farthest() -> None:
    left, right = still(3), still(3)
    left[1, :, :2] = 255
    right[1, :, 6:] = 255
    assert wmae(left, right) == pytest.approx(1.0)


def test_motion_elsewhere_in_the_tile_is_no_difference() -> None:
    one, other = still(3), still(3)
    one[1, 0, 0] = 255
    other[1, 1, 1] = 255
    assert wmae(one, other) == 0.0


def test_doubled_motion_is_a_third_away() -> None:
    small, large = still(2), still(2)
    small[1], large[1] = 100, 200
    assert wmae(small, large) == pytest.approx((200 - 100) / (200 + 100))


def test_delay_is_blurred_by_the_window() -> None:
    early, late = still(40), still(40)
    early[20:] = 255
    late[24:] = 255
    # Two windows of 8 steps that overlap by 4 differ in 8 of 16 steps.
    assert wmae(early, late) == pytest.approx(0.5)


def test_window_reaches_four_steps_back_and_three_ahead() -> None:
    flash = still(40)
    flash[20:] = 255
    active = np.flatnonzero(curve(flash, still(40)) > 0.5)
    # The step is 19 -> 20; t sees t - 4 .. t + 3, so 16 to 23 see it.
    assert active.tolist() == [*range(16, 24)]


def test_noise_within_the_dead_band_is_no_motion_and_beyond_is() -> None:
    at, above = still(3, 100), still(3, 100)
    at[1] += 24
    above[1] += 25
    moving = still(3)
    moving[1] = 200
    assert wmae(at, still(3)) == 0.0
    assert wmae(at, moving) == pytest.approx(1.0)
    assert wmae(above, moving) == pytest.approx((200 - 25) / (200 + 25))


def test_change_that_all_channels_together_make_small_is_no_motion() -> None:
    clip = still(3, 100)
    clip[1, ..., 2] += 150  # 0.114 of it is luma
    assert wmae(clip, still(3)) == 0.0


def test_luma_weighs_green_over_red_over_blue() -> None:
    clips = []
    for channel in range(3):
        clip = still(2)
        clip[1, ..., channel] = 255
        clips.append(clip)
    red, green, blue = clips
    assert wmae(green, red) == pytest.approx((0.587 - 0.299) / (0.587 + 0.299))
    assert wmae(red, blue) == pytest.approx((0.299 - 0.114) / (0.299 + 0.114))
