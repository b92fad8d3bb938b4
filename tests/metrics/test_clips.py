"""What counts as a clip and as foreground, for every metric."""

import re
from typing import Any

import numpy as np
import pytest

from mpmworlds.metrics import SCORED, Metric, View, score
from mpmworlds.metrics.clips import check_clip
from mpmworlds.metrics.view import compared

CLIP = np.zeros((2, 8, 8, 3), dtype=np.uint8)
each_metric = pytest.mark.parametrize("metric", SCORED.values(), ids=SCORED.keys())
each_compared = pytest.mark.parametrize(
    "metric",
    [m for m in SCORED.values() if m.needs_reference],
    ids=[n for n, m in SCORED.items() if m.needs_reference],
)


@pytest.mark.parametrize(
    ("array", "remedy"),
    [
        (CLIP.astype(np.float32), "multiply by 255 and round"),
        (CLIP + np.float32(200), "round it and convert it with clip.astype"),
        (CLIP.astype(np.int64), "round it and convert it with clip.astype"),
        (CLIP - np.float32(1), "decode the video to RGB bytes"),
        (CLIP + np.float32(np.nan), "values that are not finite"),
        (CLIP.transpose(0, 3, 1, 2), "clip.transpose(0, 2, 3, 1)"),
        (np.repeat(CLIP, 2, axis=3)[..., :4], "clip[..., :3]"),
        (CLIP[0], "decode the video"),
        (CLIP[..., :1], "decode the video"),
        (CLIP[:0], "decode the video"),
        (CLIP[:, :0], "decode the video"),
        (CLIP[:, :, :0], "decode the video"),
    ],
    ids=[
        *["unit floats", "floats", "ints", "negative", "NaN", "channels first"],
        *["alpha", "one frame", "grey", "no frame", "no row", "no column"],
    ],
)
def test_error_names_what_is_no_clip_and_what_to_do(array: Any, remedy: str) -> None:
    found = re.escape(f"prediction: {array.dtype} {array.shape}, ")
    with pytest.raises(ValueError, match=f"^{found}must be uint8") as caught:
        check_clip(array, "prediction")
    assert remedy in str(caught.value)
    assert "\n" not in str(caught.value)


def test_error_names_what_is_no_array() -> None:
    with pytest.raises(ValueError, match=r"reference: list, must be a numpy array"):
        compared(CLIP, CLIP.tolist())


def test_masked_array_is_refused() -> None:
    masked = np.ma.masked_equal(CLIP, 0)
    with pytest.raises(ValueError, match=r"prediction: a masked array.*filled\(0\)"):
        score(masked, CLIP)


@each_compared
@pytest.mark.parametrize("shape", [(3, 8, 8, 3), (2, 9, 8, 3), (2, 8, 9, 3)])
def test_error_names_both_shapes_when_clips_differ(
    metric: Metric, shape: tuple[int, ...]
) -> None:
    other = np.zeros(shape, dtype=np.uint8)
    with pytest.raises(
        ValueError, match=re.escape(f"prediction {CLIP.shape} and reference {shape}:")
    ):
        metric(CLIP, other)
    with pytest.raises(ValueError, match="equal shapes"):
        metric.curve_of(other, CLIP)
    with pytest.raises(ValueError, match="equal shapes"):
        metric(View(other), View(CLIP))


@each_metric
def test_metric_refuses_a_float_prediction(metric: Metric) -> None:
    with pytest.raises(ValueError, match="prediction: float64"):
        metric(CLIP / 255, CLIP)  # type: ignore[arg-type]


def test_score_refuses_clips_of_different_length() -> None:
    with pytest.raises(ValueError, match="equal shapes"):
        score(CLIP, CLIP[:1])


def test_foreground_begins_above_32_in_any_channel() -> None:
    clip = np.zeros((1, 1, 6, 3), dtype=np.uint8)
    clip[0, 0, 1] = 32
    for channel in range(3):
        clip[0, 0, 2 + channel, channel] = 33
    clip[0, 0, 5] = 255
    assert View(clip).mask[0].tolist() == [False, False, True, True, True, True]
