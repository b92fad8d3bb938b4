"""The recorded definition of the metrics."""

import dataclasses
import json

import pytest

from mpmworlds.metrics import CONSTANTS, VERSION, definition

VERSION_2 = {
    "version": "mpmworlds-metrics/2",
    "foreground_level": 32,
    "tiles_per_side": 4,
    "collapse_bins": 16,
    "collapse_min_region_px": 25,
    "collapse_min_core_px": 9,
    "collapse_merge_chromaticity": 0.05,
    "collapse_merge_brightness": 0.15,
    "collapse_area_chromaticity": 0.05,
    "collapse_area_brightness": 0.25,
    "collapse_event": 0.5,
    "wmae_luma": [299, 587, 114],
    "wmae_dead_band": 24,
    "wmae_window": 8,
    "wmae_epsilon": 1e-8,
    "color_tv_bins": 8,
    "anomaly_hue_bins": 8,
    "anomaly_saturation_bins": 4,
    "anomaly_value_bins": 4,
    "anomaly_windows": [1, 3],
    "anomaly_local_px": 64,
    "anomaly_colour_px": 200,
    "anomaly_slack": 4,
    "anomaly_excess": 0.55,
    "semd_directions": 16,
    "bootstrap_resamples": 10_000,
    "bootstrap_confidence": 0.95,
    "bootstrap_min_families": 10,
}


def test_version_2_means_exactly_these_constants() -> None:
    assert json.loads(json.dumps(definition())) == VERSION_2
    assert VERSION_2["version"] == VERSION


def test_constants_cannot_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        CONSTANTS.semd_directions = 8  # type: ignore[misc]
