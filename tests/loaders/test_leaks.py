"""No byte of a prompt or an export gives away what its regime hides."""

import json
import re

import datasets
import numpy as np
import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders import load as load_module
from mpmworlds.loaders.clips import Stills
from mpmworlds.loaders.export.folder import Source
from mpmworlds.loaders.export.sft import export_sft
from mpmworlds.loaders.export.video import export_video
from mpmworlds.loaders.load import Examples, neutral_name
from mpmworlds.loaders.prompts import TASKS, VideoForm, as_url, make_prompt
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.sim.run.encode import encode_mp4
from tests.loaders.hidden import HIDDEN, MATERIAL_WORDS, corpus, numbers_of, other
from tests.sim.clips import noise

SEEDS = load_seeds()
STILLS = Stills(np.zeros((2, 4, 4, 3), np.uint8), (0.0, 2.5))
FORM = VideoForm(300, 30, 512)
hides = pytest.mark.parametrize(("regime", "tag"), HIDDEN.items(), ids=HIDDEN)


def asked(scene, regime, task="program"):
    """All that a model gets, as one text."""
    told = REGIMES[regime].tell(scene)
    prompt = make_prompt(STILLS, REGIMES[regime], told, FORM, task, schema=True)
    return json.dumps(prompt.messages(as_url))


def differing(scenes, regime, tag):
    random = np.random.default_rng(0)
    return [
        scene
        for scene in scenes
        for task in TASKS
        if asked(other(scene, tag, random), regime, task) != asked(scene, regime, task)
    ]


def with_hidden_numbers(scenes, regime, tag):
    """Scenes of whose hidden numbers, changed to rare ones, the prompt has any."""
    random = np.random.default_rng(1)
    found = []
    for scene in scenes:
        changed = other(scene, tag, random)
        hidden = numbers_of(changed, {tag, "derived"})
        # So many digits that no other number has them by chance.
        rare = {f"{abs(number):.12f}"[:9] for number in hidden if abs(number) < 1}
        rare |= {str(number) for number in hidden if number >= 10_000}
        words = set(re.findall(r"[\d.]+", asked(changed, regime)))
        found += [(scene, word) for word in words if word[:9] in rare]
    return found


@hides
def test_scenes_that_differ_in_what_is_hidden_are_asked_about_alike(regime, tag):
    assert differing(SEEDS.values(), regime, tag) == []


@pytest.mark.slow
@hides
def test_thousands_of_scenes_are_asked_about_alike(regime, tag):
    assert differing(corpus(), regime, tag) == []


@hides
def test_no_number_that_is_hidden_is_in_a_prompt(regime, tag):
    assert with_hidden_numbers(SEEDS.values(), regime, tag) == []


@pytest.mark.slow
@hides
def test_no_number_that_is_hidden_is_in_thousands_of_prompts(regime, tag):
    assert with_hidden_numbers(corpus(), regime, tag) == []


@pytest.mark.slow
def test_no_word_of_a_material_is_in_thousands_of_prompts():
    for scene in corpus():
        words = set(re.findall(r"\w+", asked(scene, "no_materials")))
        assert not words & MATERIAL_WORDS, scene


def test_without_a_scene_all_are_asked_about_alike():
    assert len({asked(scene, "frames_only") for scene in SEEDS.values()}) == 1


def test_what_a_regime_shows_is_asked_with():
    for scene in SEEDS.values():
        assert json.dumps(scene.to_yaml().strip())[1:-1] in asked(scene, "full_config")


@pytest.fixture
def examples_of(monkeypatch):
    """Function scenes, regime -> examples with one and the same video."""
    known = {}

    class Known:
        @staticmethod
        def from_yaml(text, source):
            return known[text]

    video = {"bytes": encode_mp4(noise(8, 16), 2), "path": None}
    monkeypatch.setattr(load_module, "Scene", Known)

    def build(scenes, regime):
        rows = []
        for number, scene in enumerate(scenes):
            text = f"{len(known)}"
            known[text] = scene
            rows.append(
                {"id": f"p{number:04d}-c1", "kind": "child", "scene": text}
                | {"program": f"# {text}", "video": video, "framerate": 2}
                | {"num_frames": 8, "resolution": 16}
            )
        return Examples(datasets.Dataset.from_list(rows), regime)

    return build


def exported(examples, out, write):
    """Path -> bytes of all files of an export, without answers."""

    class Given(Source):
        def load(self):
            return examples

        def noted(self):
            return {}

    write(Given(out, "tiny", "train", examples.regime.name), out)
    files = {
        str(p.relative_to(out)): p.read_bytes() for p in out.rglob("*.*") if p.is_file()
    }
    if chats := files.get("train.jsonl"):
        records = [json.loads(line) for line in chats.splitlines()]
        for record in records:
            assert record["messages"].pop()["role"] == "assistant"
            assert record["sample"] not in json.dumps(record["messages"])
        files["train.jsonl"] = records
    return files


@pytest.mark.parametrize("write", [export_sft, export_video])
@hides
def test_exports_of_scenes_that_differ_in_what_is_hidden_are_alike(
    regime, tag, write, examples_of, tmp_path
):
    random = np.random.default_rng(2)
    scenes = list(SEEDS.values())[::5]
    first = examples_of(scenes, regime)
    second = examples_of([other(scene, tag, random) for scene in scenes], regime)
    one = exported(first, tmp_path / "one", write)
    assert one == exported(second, tmp_path / "two", write)
    assert len(one) > len(scenes)
    assert not [path for path in one if re.search(r"p\d{4}|-c\d", path)]


def test_names_of_files_say_nothing_of_a_sample():
    names = [neutral_name(name) for name in ("p0001", "p0001-c1", "p0001-c1-n01")]
    assert len({name[:4] for name in names}) == 3
    assert all(re.fullmatch(r"[0-9a-f]{16}", name) for name in names)
