"""A new colour is vivid, bright enough and of a hue of its own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.recipes.colors import (
    HUE_STEP,
    LEAST_HUE_STEP,
    LEAST_LUMA,
    VIVID,
    confusing,
    free_color,
)
from mpmworlds.builder.recipes.objects import NoRoomError
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.scene.palette import PALETTE, hue_difference, luma
from tests.builder.recipes.edits import (
    generators,
)


def colored(*colors):
    return [{"visualization": {"color": color}} for color in colors]


@given(generators, st.lists(st.sampled_from(list(PALETTE.values())), max_size=5))
def test_a_free_colour_is_vivid_and_of_a_hue_of_its_own(rng, used):
    color = free_color(rng, colored(*used))
    assert color in VIVID
    assert luma(color) >= LEAST_LUMA
    greys = ("#FFFFFF", "#C8C8C8", "#969696")
    hued = [other for other in used if other not in greys]
    assert all(hue_difference(color, other) > LEAST_HUE_STEP for other in hued)
    if len(used) <= 2:
        assert all(hue_difference(color, other) > HUE_STEP for other in hued)


def test_without_room_for_another_hue_there_is_no_colour():
    used = colored(*list(PALETTE.values())[:24:2])
    with pytest.raises(NoRoomError, match="no colour is free"):
        free_color(np.random.default_rng(0), used)


def test_two_of_a_hue_or_a_dark_one_confuse():
    red, dark, grey = PALETTE["red"], PALETTE["deep_blue"], PALETTE["grey"]
    assert not confusing([red, PALETTE["azure"], grey, grey])
    assert confusing([red, PALETTE["azure"], red])
    assert confusing([red, PALETTE["vermilion"]])
    assert confusing([dark, red])


@pytest.mark.parametrize("name", load_seeds())
def test_no_seed_has_confusing_colours(name):
    scene = load_seeds()[name]
    assert not confusing([thing.visualization.color for thing in scene.objects])
