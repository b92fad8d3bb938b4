"""What a view counts, by the table of flat clips and the long way of noisy ones."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mpmworlds.metrics import SCORED, View, score
from mpmworlds.metrics import view as view_module
from mpmworlds.metrics.clips import Clip

CLIPS = arrays(np.uint8, (3, 5, 9, 3), elements=st.sampled_from([0, 32, 33, 90, 255]))
both_ways = pytest.mark.parametrize("table", [4_000_000, 0], ids=["table", "long way"])


@both_ways
@settings(max_examples=30, deadline=None)
@given(clip=CLIPS)
def test_histogram_and_areas_agree_with_counted_pixels(table: int, clip: Clip) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_module, "LARGEST_TABLE", table)
        view = View(clip)
        bins = np.arange(view.colours.size) % 3
        histogram = view.histogram(bins, 3)
        areas = view.areas(bins == np.arange(3)[:, None])
    number = {int(colour): k % 3 for k, colour in enumerate(view.colours)}
    for t, frame in enumerate(clip.tolist()):
        count: Counter[tuple[int, int]] = Counter()
        for y, row in enumerate(frame):
            for x, (r, g, b) in enumerate(row):
                if max(r, g, b) > 32:
                    tile = 4 * max(i for i in range(4) if y >= i * 5 // 4)
                    tile += max(i for i in range(4) if x >= i * 9 // 4)
                    count[tile, number[r << 16 | g << 8 | b]] += 1
        expected = [[count[tile, b] for b in range(3)] for tile in range(16)]
        assert histogram[t].tolist() == expected
        assert areas[:, t].tolist() == np.sum(expected, axis=0).tolist()


def test_both_ways_lead_to_the_same_scores(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(0)
    pred = random.integers(0, 256, (9, 24, 24, 3), dtype=np.uint8)
    ref = np.roll(pred, 3, axis=2)
    short = score(pred, ref)
    monkeypatch.setattr(view_module, "LARGEST_TABLE", 0)
    assert score(pred, ref) == short


def test_views_score_like_their_clips_however_often_they_are_used() -> None:
    random = np.random.default_rng(1)
    pred, ref = random.integers(0, 256, (2, 9, 16, 16, 3), dtype=np.uint8)
    expected = {name: metric(pred, ref) for name, metric in SCORED.items()}
    one, other = View(pred), View(ref)
    for _ in range(2):
        assert score(one, other) == expected
    assert score(other, one) == score(ref, pred)


def test_black_clip_has_no_colours() -> None:
    view = View(np.zeros((2, 8, 8, 3), np.uint8))
    assert view.colours.size == 0
    assert view.histogram(np.zeros(0, np.intp), 5).sum() == 0
    assert view.areas(np.zeros((2, 0), bool)).tolist() == [[0, 0], [0, 0]]
