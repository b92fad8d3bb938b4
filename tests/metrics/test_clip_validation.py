"""What counts as a clip and as foreground, for every metric."""

import re

import numpy as np
import pytest

from mpmworlds.metrics import SCORED, Metric, score
from mpmworlds.metrics.clips import check_clip, check_pair, foreground

CLIP = np.zeros((2, 8, 8, 3), dtype=np.uint8)
each_metric = pytest.mark.parametrize("metric", SCORED.values(), ids=SCORED.keys())
each_compared = pytest.mark.parametrize(
    "metric",
    [m for m in SCORED.values() if m.needs_reference],
    ids=[n for n, m in SCORED.items() if m.needs_reference],
)


@pytest.mark.parametrize(
    "array",
    [
        CLIP.astype(np.float32),
        CLIP[0],
        CLIP[..., :1],
        CLIP[:0],
        CLIP[:, :0],
        CLIP[:, :, :0],
    ],
    ids=["float", "one frame", "grey", "no frame", "no row", "no column"],
)
def test_error_names_type_and_shape_of_what_is_no_clip(
    array: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
) -> None:
    found = re.escape(f"prediction: {array.dtype} {array.shape}, ")
    with pytest.raises(ValueError, match=f"^{found}must be uint8"):
        check_clip(array, "prediction")


def test_error_names_what_is_no_array() -> None:
    with pytest.raises(ValueError, match=r"reference: list, must be a numpy array"):
        check_pair(CLIP, CLIP.tolist())


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
        metric.curve(other, CLIP)


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
    assert foreground(clip)[0, 0].tolist() == [False, False, True, True, True, True]
