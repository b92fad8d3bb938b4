"""Squared difference of pixel values."""

import numpy as np
import pytest

from mpmworlds.metrics import mse
from mpmworlds.metrics.definitions.mse import curve


def test_mse_of_black_and_white_is_one() -> None:
    black = np.zeros((2, 256, 256, 3), dtype=np.uint8)
    assert mse(black, ~black) == 1.0


def test_mse_of_one_changed_channel() -> None:
    ref = np.zeros((2, 2, 5, 3), dtype=np.uint8)
    pred = ref.copy()
    pred[1, 0, 0, 1] = 51
    assert curve(pred, ref).tolist() == [0.0, pytest.approx(0.2**2 / 30)]
    assert mse(pred, ref) == pytest.approx(0.2**2 / 60)


def test_mse_agrees_with_floating_point_evaluation() -> None:
    random = np.random.default_rng(0)
    pred, ref = random.integers(0, 256, (2, 3, 31, 17, 3), dtype=np.uint8)
    assert mse(pred, ref) == pytest.approx(np.mean((pred / 255 - ref / 255) ** 2))
