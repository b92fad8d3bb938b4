"""The recorded definition of the metrics."""

import dataclasses
import json

import pytest

from mpmworlds.metrics import CONSTANTS, VERSION, definition

VERSION_1 = {
    "version": "mpmworlds-metrics/1",
    "foreground_level": 32,
    "tiles_per_side": 4,
    "collapse_min_region_px": 25,
    "collapse_merge_chromaticity": 0.05,
    "collapse_merge_brightness": 0.15,
    "collapse_area_chromaticity": 0.05,
    "collapse_area_brightness": 0.25,
    "collapse_event": 0.5,
    "wmae_luma": [299, 587, 114],
    "wmae_window": 8,
    "wmae_epsilon": 1e-8,
    "color_tv_bins": 8,
    "anomaly_hue_bins": 8,
    "anomaly_saturation_bins": 4,
    "anomaly_value_bins": 4,
    "anomaly_window": 3,
    "anomaly_excess": 0.25,
    "semd_directions": 32,
    "bootstrap_resamples": 10_000,
    "bootstrap_confidence": 0.95,
}


def test_version_1_means_exactly_these_constants() -> None:
    assert json.loads(json.dumps(definition())) == VERSION_1
    assert VERSION_1["version"] == VERSION


def test_constants_cannot_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        CONSTANTS.semd_directions = 8  # type: ignore[misc]
