"""Prompts: pictures with their times, what the regime tells, and nothing else."""

import base64
import hashlib
import json
from importlib.resources import files

import cv2
import jsonschema
import numpy as np
import pytest
import yaml

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.clips import Stills
from mpmworlds.loaders.load import load
from mpmworlds.loaders.prompts import (
    PROMPT_VERSION,
    TASKS,
    Picture,
    VideoForm,
    answer_of,
    as_place,
    as_url,
    make_prompt,
    png_of,
    prompt_for,
)
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.loaders.scaffold import RULES, SCAFFOLD_VERSION, SKELETON
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run

FORM = VideoForm(300, 30, 512)
# A text that is changed gets another version, and its hash then stands here.
WORDINGS = {
    "mpmworlds-scaffold/1": "006505bd1465c292",
    "mpmworlds-prompt/2": "c21eab9eeabfe9b3",
}


def stills(n=3):
    frames = np.arange(n, dtype=np.uint8)[:, None, None, None]
    return Stills(np.broadcast_to(frames, (n, 8, 8, 3)), tuple(range(n)))


@pytest.mark.parametrize(
    ("name", "version"), [("scaffold", SCAFFOLD_VERSION), ("prompts", PROMPT_VERSION)]
)
def test_a_version_stands_for_its_words(name, version):
    file = files("mpmworlds.loaders").joinpath("wording", f"{name}.yaml")
    assert hashlib.sha256(file.read_bytes()).hexdigest()[:16] == WORDINGS[version]


def test_the_skeleton_is_a_program_that_shows_nothing():
    outcome = run(SKELETON, max_frames=3)
    assert outcome.status == "ok", outcome.message
    assert outcome.frames.shape == (3, 512, 512, 3)
    assert not outcome.frames.any()


def test_the_skeleton_has_the_sections_of_the_corpus():
    program = link(load_seeds()["s04_bouncing_blocks"])
    headings = [line for line in SKELETON.splitlines() if line.startswith("# ")]
    assert [line for line in program.splitlines() if line.startswith("# ")] == headings


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("regime", REGIMES.values(), ids=REGIMES)
def test_a_user_shows_pictures_with_their_times_then_what_the_regime_tells(
    regime, task
):
    prompt = make_prompt(stills(), regime, "" if regime.blind else "told", FORM, task)
    texts = [part for part in prompt.user if isinstance(part, str)]
    assert "300 frames of 512 x 512 pixels, 30 a second" in texts[0]
    assert "2.5 s, in 3 pictures" in texts[0]
    assert texts[1:4] == ["t = 0.000 s", "t = 1.000 s", "t = 2.000 s"]
    assert [p.seconds for p in prompt.pictures] == [0, 1, 2]
    assert isinstance(prompt.user[2], Picture)
    assert ("told" in texts[4].split("\n")) is not regime.blind
    assert texts[5] == f"Write the {task}."
    assert len(texts) == 6


def test_a_program_is_asked_for_with_the_scaffold():
    system = make_prompt(stills(), REGIMES["frames_only"], "", FORM).system
    assert RULES in system and SKELETON in system
    assert "one block of ```python" in system


def test_a_scene_is_asked_for_with_its_schema_on_request():
    ways = [
        make_prompt(stills(), REGIMES["caption"], "x", FORM, "scene", schema=schema)
        for schema in (False, True)
    ]
    short, long = (prompt.system for prompt in ways)
    assert "```json" not in short and SKELETON not in long
    (line,) = [line for line in long.splitlines() if line.startswith("{")]
    scene = load_seeds()["s19_five_materials"]
    jsonschema.validate(scene.to_data(), json.loads(line))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(scene.to_data() | {"title": "snow"}, json.loads(line))


def test_an_unknown_task_is_an_error_that_names_the_known_ones():
    with pytest.raises(ValueError, match="'poem', must be one of program, scene"):
        make_prompt(stills(), REGIMES["caption"], "x", FORM, "poem")


def test_messages_are_such_as_servers_take():
    prompt = make_prompt(stills(2), REGIMES["frames_only"], "", FORM)
    system, user = prompt.messages(as_url)
    assert (system["role"], user["role"]) == ("system", "user")
    urls = [p["image_url"]["url"] for p in user["content"] if p["type"] != "text"]
    png = base64.b64decode(urls[1].removeprefix("data:image/png;base64,"))
    assert (cv2.imdecode(np.frombuffer(png, np.uint8), -1) == 1).all()
    shown = prompt.messages(as_place)[1]["content"]
    assert [p["type"] for p in shown if p["type"] != "text"] == ["image", "image"]
    assert {key for part in shown for key in part} == {"type", "text"}


def test_a_picture_is_the_frame_exactly():
    frame = np.random.default_rng(0).integers(0, 256, (16, 16, 3), np.uint8)
    seen = cv2.imdecode(np.frombuffer(png_of(frame), np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(seen[..., ::-1], frame)


def test_the_answer_is_the_program_or_the_scene_in_a_block():
    row = {"program": "import numpy\n", "scene": "schema: x\n"}
    assert answer_of(row, "program") == "```python\nimport numpy\n```"
    assert yaml.safe_load(answer_of(row, "scene")[8:-4]) == {"schema": "x"}


def test_an_example_is_asked_about(release):
    example = load(release)[0]
    prompt = prompt_for(example, pictures=3)
    assert "8 frames of 64 x 64 pixels, 2 a second" in prompt.user[0]
    assert [picture.seconds for picture in prompt.pictures] == [0.0, 1.5, 2.5]
    for secret in (example.id, example.row["scene"], example.row["program"]):
        assert not any(secret in str(part) for part in prompt.user)
