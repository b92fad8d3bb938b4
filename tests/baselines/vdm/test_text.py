"""Texts for video models."""

from pathlib import Path

import pytest

from mpmworlds.baselines.vdm.text import text_for
from mpmworlds.loaders.prompts import CONTINUE
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene

SEEDS = sorted((Path(__file__).resolve().parents[3] / "builder" / "seeds").glob("*"))
SCENES = {path.stem: Scene.from_yaml(path.read_text(), path.name) for path in SEEDS}
SCENE = next(iter(SCENES.values()))
TOLD = [name for name, regime in REGIMES.items() if not regime.blind]


def test_nothing_is_told_in_words():
    assert text_for("") == CONTINUE


@pytest.mark.parametrize("regime", TOLD)
@pytest.mark.parametrize("scene", SCENES)
def test_text_is_one_line_of_fewer_letters(scene, regime):
    told = REGIMES[regime].tell(SCENES[scene])
    text = text_for(told)
    assert text == " ".join(text.split())
    assert len(text) <= len(told)


@pytest.mark.parametrize("scene", SCENES)
def test_each_object_is_told_by_its_colour_and_matter(scene):
    text = text_for(REGIMES["full_config"].tell(SCENES[scene]))
    objects = text.split("; ")[1:]
    assert len(objects) == len(SCENES[scene].objects)
    names = {color: name.replace("_", " ") for name, color in PALETTE.items()}
    for told, thing in zip(objects, SCENES[scene].objects, strict=True):
        assert told.startswith(thing.object_type.replace("_", " "))
        assert names[thing.visualization.color] in told
        matter = getattr(thing, "physics_properties", None)
        assert matter is None or matter.constitutive_model.replace("_", " ") in told


def test_a_caption_is_told_as_it_is():
    told = REGIMES["caption"].tell(SCENE)
    assert text_for(told) == told


def test_numbers_have_three_digits_and_no_needless_signs():
    told = "objects:\n- {size: [0.39641, -0.5], rate: 1242.0, n: 2, v: [0.0, 0.0]}\n"
    assert text_for(f"gravity: [0.0, -9.8]\n{told}") == (
        "gravity 0 -9.8; size .396 -.5 rate 1240 n 2"
    )


def test_what_a_regime_hides_does_not_come_back():
    text = text_for(REGIMES["no_materials"].tell(SCENE))
    assert "youngs" not in text
    assert "density" not in text
    assert "center" in text
    assert "center" not in text_for(REGIMES["no_positions"].tell(SCENE))
