"""A regime tells nothing of what it hides: not in words, numbers, order or lengths."""

import re

import numpy as np
import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.regimes import REGIMES, regime_named
from mpmworlds.sim.scene.scene import Scene
from tests.loaders.hidden import HIDDEN, MATERIAL_WORDS, corpus, other

SEEDS = load_seeds()
hides = pytest.mark.parametrize(("regime", "tag"), HIDDEN.items(), ids=HIDDEN)
each_seed = pytest.mark.parametrize("scene", SEEDS.values(), ids=SEEDS)


def never_twice(scenes, regime, tag):
    """Scenes that are told differently when only what is hidden is changed."""
    random = np.random.default_rng(0)
    tell = REGIMES[regime].tell
    return [s for s in scenes if tell(other(s, tag, random)) != tell(s)]


@each_seed
@hides
def test_what_is_hidden_changes_nothing_that_is_told(scene, regime, tag):
    assert never_twice([scene] * 5, regime, tag) == []


@pytest.mark.slow
@hides
def test_the_corpus_gives_nothing_away(regime, tag):
    assert len(corpus()) > 2000
    assert never_twice(corpus(), regime, tag) == []


@each_seed
def test_what_is_not_hidden_is_told(scene):
    random = np.random.default_rng(0)
    for regime, tag in (("no_materials", "position"), ("no_positions", "material")):
        tell = REGIMES[regime].tell
        assert tell(other(scene, tag, random)) != tell(scene)
        assert tell(other(scene, "appearance", random)) is not None


@pytest.mark.slow
def test_no_word_of_a_material_is_told_without_materials():
    for scene in corpus():
        told = set(re.findall(r"\w+", REGIMES["no_materials"].tell(scene)))
        assert not told & MATERIAL_WORDS, scene


@each_seed
def test_the_whole_configuration_is_the_scene(scene):
    assert Scene.from_yaml(REGIMES["full_config"].tell(scene)) == scene


@each_seed
def test_frames_only_tells_nothing(scene):
    assert REGIMES["frames_only"].tell(scene) == ""


@each_seed
def test_a_caption_names_every_object_its_material_and_no_number(scene):
    told = REGIMES["caption"].tell(scene)
    assert not re.search(r"\d", re.sub(r"object_\d+", "", told))
    assert told.count(".") == len(scene.objects) + 1
    for material in scene.materials:
        assert material.replace("_", " ") in told
    for thing in scene.objects:
        assert f"{thing.name}: " in told


def test_an_unknown_regime_is_an_error_that_names_the_known_ones():
    with pytest.raises(ValueError, match=r"regime 'all': unknown.*'no_positions'"):
        regime_named("all")
