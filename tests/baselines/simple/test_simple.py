"""Each simple predictor does the one thing that it is named after."""

import itertools

import numpy as np
import pytest

from mpmworlds.baselines.filling import filled, scene_of, told_scene
from mpmworlds.baselines.protocol import Answers, Failure, SceneText
from mpmworlds.baselines.scoring import task_of
from mpmworlds.baselines.simple.codec import Codec
from mpmworlds.baselines.simple.config_oracle import (
    ConfigOracle,
    SeenPositions,
    TypicalMaterials,
)
from mpmworlds.baselines.simple.noise_ceiling import NoiseCeiling
from mpmworlds.baselines.simple.optical_flow import OpticalFlow
from mpmworlds.baselines.simple.ping_pong import PingPong
from mpmworlds.baselines.thumbnails import Thumbnails, thumbnail
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.metrics import mask_iou
from mpmworlds.sim.scene.scene import Scene

SEEDS = load_seeds()


def row(scene):
    return {"scene": scene.to_yaml(), "program": "def frames(): ..."}


@pytest.fixture
def example(make_example):
    return make_example()


def test_ping_pong_turns_round_at_both_ends(example):
    task = task_of(example)  # 6 + 10 frames
    (found,) = PingPong().predict(task)
    order = [4, 3, 2, 1, 0, 1, 2, 3, 4, 5]
    np.testing.assert_array_equal(found.continuation, task.prefix[order])


def test_optical_flow_moves_on_what_moved_without_new_colours(example):
    task = task_of(example)
    (found,) = OpticalFlow().predict(task)
    assert found.continuation.shape == example.continuation.shape
    colours = {tuple(c) for c in found.continuation.reshape(-1, 3)}
    assert colours <= {(0, 0, 0), (200, 40, 40)}
    still = np.repeat(task.prefix[-1:], 3, axis=0)
    truth = example.continuation[:3]
    assert mask_iou(found.continuation[:3], truth) > mask_iou(still, truth)


def test_the_codec_changes_little_and_less_at_higher_quality(example):
    answers = Answers({}, example.continuation)
    clips = [
        Codec(crf).reveal(task_of(example), answers)[0].continuation for crf in (1, 40)
    ]
    errors = [np.abs(c.astype(int) - example.continuation).mean() for c in clips]
    assert 0 < errors[0] < errors[1] < 20


def test_the_ceiling_is_the_program_and_a_bit(example):
    (found,) = NoiseCeiling(3).reveal(
        task_of(example), Answers(row(next(iter(SEEDS.values()))), example.continuation)
    )
    assert found.text.startswith("def frames(): ...")
    assert "default_rng(3)" in found.text


def test_the_config_oracle_says_what_it_is_told(example):
    task = task_of(example)
    assert ConfigOracle().predict(task) == [SceneText("")]


@pytest.mark.parametrize("name", sorted(SEEDS))
def test_typical_materials_keep_the_class_and_all_else(name, example):
    scene = SEEDS[name]
    (found,) = TypicalMaterials().reveal(
        task_of(example), Answers(row(scene), example.continuation)
    )
    assert isinstance(found, SceneText), found
    other = Scene.from_yaml(found.text)
    assert other.materials == scene.materials
    told = [REGIMES["no_materials"].tell(s) for s in (scene, other)]
    assert told[0] == told[1]


def test_positions_are_read_off_the_first_frame(example):
    scene = SEEDS[sorted(SEEDS)[0]]
    data = scene.to_data()
    frame = np.zeros((100, 100, 3), np.uint8)
    color = data["objects"][0]["visualization"]["color"]
    frame[20:30, 40:60] = [int(color[k : k + 2], 16) for k in (1, 3, 5)]
    task = task_of(example)
    object.__setattr__(task, "prefix", frame[None])
    (found,) = SeenPositions().reveal(task, Answers(row(scene), frame[None]))
    if isinstance(found, SceneText):
        objects = Scene.from_yaml(found.text).to_data()["objects"]
        assert objects[0]["shape"]["center"] == [0.5, 0.75]
        assert objects[1]["shape"]["center"] == [0.5, 0.5]
    else:
        assert found.outcome == "invalid_scene"


# ---- scenes with gaps


@pytest.mark.parametrize("regime", ["full_config", "no_materials", "no_positions"])
@pytest.mark.parametrize("name", sorted(SEEDS))
def test_a_scene_whose_gaps_are_filled_from_itself_is_itself(name, regime):
    scene = SEEDS[name]
    told = told_scene(REGIMES[regime].tell(scene))
    assert filled(told, scene.to_data()) == scene.to_data()
    (again,) = [scene_of(filled(told, scene.to_data()))]
    assert isinstance(again, SceneText), again


def test_gaps_are_filled_from_another_scene():
    scenes = [SEEDS[name] for name in sorted(SEEDS)]
    outcomes = []
    for one, other in itertools.pairwise(scenes):
        told = told_scene(REGIMES["no_materials"].tell(one))
        found = scene_of(filled(told, other.to_data()))
        outcomes.append(isinstance(found, SceneText))
        if isinstance(found, Failure):
            assert found.outcome == "invalid_scene"
    assert sum(outcomes) > len(outcomes) / 2


@pytest.mark.parametrize("text", ["", "Gravity pulls down.", "a: [", "objects: 3"])
def test_what_is_no_scene_tells_none(text):
    assert told_scene(text) is None


# ---- retrieval


def test_the_nearest_thumbnail_is_the_one_most_alike(make_example):
    prefixes = [make_example(speed=s).prefix for s in (0, 1, 2)]
    known = Thumbnails(np.stack([thumbnail(p) for p in prefixes]))
    assert [known.nearest(thumbnail(p)) for p in prefixes] == [0, 1, 2]
