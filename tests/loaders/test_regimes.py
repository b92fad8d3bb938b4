"""A regime tells nothing of what it hides: not in words, numbers, order or lengths."""

import re
from functools import cache

import numpy as np
import pytest

from mpmworlds.builder.plan.manifest import read_table, recorded_manifest
from mpmworlds.builder.recipes.tables import first_tables
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.regimes import REGIMES, regime_named
from mpmworlds.sim.scene.fields import Part, parts_of, tag_of
from mpmworlds.sim.scene.objects import MATERIALS
from mpmworlds.sim.scene.scene import Scene

SEEDS = load_seeds()
STRIDE = 97  # of the rows of the full corpus that are looked at
each_seed = pytest.mark.parametrize("scene", SEEDS.values(), ids=SEEDS)


@cache
def corpus():
    """About a thousand scenes of all kinds."""
    texts = read_table(recorded_manifest("full"), ["id", "scene"]).to_pylist()
    return [Scene.from_yaml(row["scene"], row["id"]) for row in texts[::STRIDE]]


def other(part, tag, random):
    """A part with other values wherever a field has a tag; it may be no valid one."""
    changed = {}
    for name in type(part).model_fields:
        value = getattr(part, name)
        if tag_of(type(part), name) in (tag, "derived"):
            changed[name] = another_value(value, random)
        elif isinstance(value, Part):
            changed[name] = other(value, tag, random)
        elif isinstance(value, tuple) and isinstance(value[0], Part):
            changed[name] = tuple(other(item, tag, random) for item in value)
    if tag == "material" and "physics_properties" in changed:
        changed["physics_properties"] = another_material(part, random)
    return part.model_copy(update=changed)


def another_value(value, random):
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return tuple(another_value(item, random) for item in value)
    if isinstance(value, int):
        return int(random.integers(2, 1 << 20))
    return float(random.uniform(-1.0, 1.0))


def another_material(thing, random):
    """Another constitutive model, with its own parameters."""
    kinds = parts_of(type(thing).model_fields["physics_properties"].annotation)
    kind = kinds[random.integers(len(kinds))]
    (name,) = kind.model_fields["constitutive_model"].annotation.__args__
    return kind(constitutive_model=name, **first_tables().typical[name])


def never_twice(scenes, regime, tag):
    """Scenes that are told differently when only what is hidden is changed."""
    random = np.random.default_rng(0)
    tell = REGIMES[regime].tell
    return [s for s in scenes if tell(other(s, tag, random)) != tell(s)]


@each_seed
@pytest.mark.parametrize(
    ("regime", "tag"), [("no_materials", "material"), ("no_positions", "position")]
)
def test_what_is_hidden_changes_nothing_that_is_told(scene, regime, tag):
    assert never_twice([scene] * 5, regime, tag) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("regime", "tag"), [("no_materials", "material"), ("no_positions", "position")]
)
def test_the_corpus_gives_nothing_away(regime, tag):
    assert len(corpus()) > 900
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
    words = set(MATERIALS)
    fields = {
        name
        for kind in MATERIALS.values()
        for name in kind.model_fields
        if tag_of(kind, name) == "material"
    } - {"friction", "skin_cells"}  # walls and solids have them, too
    for scene in corpus():
        told = set(re.findall(r"\w+", REGIMES["no_materials"].tell(scene)))
        assert not told & (words | fields), scene


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
