"""What has settled goes on from where it was seen, and nothing else does."""

import numpy as np
import pytest

from mpmworlds.baselines.protocol import Candidate, SceneText, Task
from mpmworlds.baselines.search import predictor
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.settling import carried, matter_of, settled, unrest
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.sim.scene.palette import rgb
from tests.baselines.search.worlds import COLORS, world

RESTING, FALLING = COLORS[0], COLORS[5]
KNOWN = 8


def clip(frames, aside=0):
    """A block that lies and one that falls; `aside` as a scene that is a little off."""
    found = np.zeros((frames, 64, 64, 3), np.uint8)
    for number, frame in enumerate(found):
        frame[50:58, 10 + aside : 22 + aside] = rgb(RESTING)
        frame[2 * number : 2 * number + 8, 40 + aside : 48 + aside] = rgb(FALLING)
    return found


@pytest.fixture
def labels():
    return labels_of(clip(KNOWN))


def test_unrest_is_the_share_of_an_area_that_changes(labels):
    assert unrest(labels, RESTING) == 0.0
    assert unrest(labels, FALLING) == pytest.approx(0.4)  # 2 rows of 8, at both ends
    assert settled(labels, COLORS, 0.01) == [RESTING]
    assert settled(labels, [FALLING], 0.01) == []
    assert unrest(labels_of(clip(1)), RESTING) == np.inf


def test_what_rests_stays_where_it_was_seen(labels):
    truth, found = clip(20), carried(clip(20, aside=2), labels, [RESTING])
    is_block = (truth == rgb(RESTING)).all(axis=3)
    np.testing.assert_array_equal((found == rgb(RESTING)).all(axis=3), is_block[KNOWN:])


def test_what_falls_is_as_it_is_drawn(labels):
    drawn = clip(20, aside=2)
    found = carried(drawn, labels, [RESTING])
    falls = (drawn == rgb(FALLING)).all(axis=3)
    np.testing.assert_array_equal((found == rgb(FALLING)).all(axis=3), falls[KNOWN:])


def test_what_is_carried_away_later_goes(labels):
    drawn = clip(20, aside=2)
    drawn[15:, 50:58, 10:24] = 0
    drawn[15:, 20:28, 10:22] = rgb(RESTING)
    found = carried(drawn, labels, [RESTING])
    np.testing.assert_array_equal(found[15 - KNOWN :], drawn[15:])


def test_a_scene_whose_matter_rests_is_answered_with_its_frames():
    scene = world("ball", "still", cells=32, form=VideoForm(90, 15, 64))
    (color,) = matter_of(scene)
    prefix = np.zeros((38, 64, 64, 3), np.uint8)
    prefix[:, 50:58, 10:22] = rgb(color)
    task = Task("x", prefix, "", "frames_only", 52, 15, VideoForm(90, 15, 64))
    answer = predictor.answer(task, scene.to_yaml())
    assert isinstance(answer, Candidate)
    assert answer.scene == scene.to_yaml()
    assert (len(answer.prefix), len(answer.continuation)) == (38, 52)
    for number, frame in enumerate(prefix):
        frame[50:58] = np.roll(frame[50:58], number, axis=1)
    assert answer != predictor.answer(task, scene.to_yaml())
    assert isinstance(predictor.answer(task, scene.to_yaml()), SceneText)
