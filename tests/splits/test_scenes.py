"""Scenes of a manifest are read back as they are, only faster."""

import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.splits.scenes import recorded_scene

SEEDS = load_seeds()


@pytest.mark.parametrize("name", SEEDS)
def test_recorded_scene_is_the_scene(name):
    assert recorded_scene(SEEDS[name].to_yaml(), name) == SEEDS[name]


@pytest.mark.parametrize(
    "text", ["", "# no scene\n", "objects: 3\n", "objects: []\n", "a: [", "- 1\n"]
)
def test_text_that_is_no_scene_is_an_error_that_names_its_sample(text):
    with pytest.raises(ValueError, match="p0123: its scene cannot be read"):
        recorded_scene(text, "p0123")
