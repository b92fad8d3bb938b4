"""Training of a LoRA on a random pipeline."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from mpmworlds.baselines.learned import devices
from mpmworlds.baselines.learned.devices import GIB, TooLittleMemoryError
from mpmworlds.baselines.learned.notes import CheckpointError
from mpmworlds.baselines.vdm.backends.wan_pipeline import load_pipeline
from mpmworlds.baselines.vdm.lora.checkpoints import OPTIMISER, WEIGHTS, restore
from mpmworlds.baselines.vdm.lora.loss import continuation_loss, noise_level
from mpmworlds.baselines.vdm.lora.run import Run
from mpmworlds.baselines.vdm.lora.windows import Window, Windows
from mpmworlds.baselines.vdm.predictor import Vdm
from mpmworlds.baselines.vdm.settings import TrainingSettings
from mpmworlds.baselines.vdm.training import train
from mpmworlds.loaders.export.folder import Source
from tests.baselines.vdm.tiny import save_pipeline


@pytest.fixture(scope="module")
def source(clips):
    return Source(clips, "tiny", "train", "full_config")


@pytest.fixture(scope="module")
def settings(pipeline):
    return TrainingSettings.read("tiny", {"checkpoint": str(pipeline)})


@pytest.fixture(scope="module")
def trained(source, settings, tmp_path_factory):
    """Folder of a training that was not interrupted. Read-only."""
    out = tmp_path_factory.mktemp("trained") / "model"
    return train(source, settings, out, progress=False)


def changed(settings, **values):
    return settings.model_copy(update=values)


def test_training_that_went_on_is_the_one_that_was_not_interrupted(
    source, settings, trained, tmp_path
):
    out = tmp_path / "model"
    train(source, changed(settings, steps=3, save_every=1), out, progress=False)
    # What a killed process may leave: a checkpoint that is not whole, and losses.
    shutil.rmtree(out / "step-0000003")
    (out / ".step-0000003.part").mkdir()
    (out / "mpmworlds.json").unlink()
    train(source, settings, out, progress=False)
    assert (out / "losses.jsonl").read_text() == (trained / "losses.jsonl").read_text()
    one, two = load_file(out / WEIGHTS), load_file(trained / WEIGHTS)
    assert one.keys() == two.keys()
    assert all(torch.equal(one[name], two[name]) for name in one)
    one, two = (
        torch.load(folder / "step-0000004" / OPTIMISER)["state"]
        for folder in (out, trained)
    )
    assert one.keys() == two.keys()
    assert all(
        torch.equal(one[key][name], two[key][name]) for key in one for name in one[key]
    )


@pytest.mark.long
def test_processes_share_a_training_that_goes_on_as_well(
    clips, pipeline, tmp_path, monkeypatch
):
    """Two processes of torch, which wait for each other by gloo."""
    monkeypatch.setenv("ACCELERATE_USE_CPU", "true")
    losses, weights = set(), []
    for name, stops in (("one", [3]), ("two", [2, 3])):
        out = tmp_path / name
        for steps in stops:
            told = ["--recipe", "tiny", "--set", f"checkpoint={pipeline}"]
            done = subprocess.run(
                [sys.executable, "-m", "torch.distributed.run", "--nproc-per-node=2"]
                + ["-m", "mpmworlds", "train", "vdm", "--release", str(clips), *told]
                + ["--set", f"steps={steps}", "--out", str(out)],
                capture_output=True,
                text=True,
            )
            assert done.returncode == 0, done.stderr
        weights.append((out / WEIGHTS).read_bytes())
        losses.add((out / "losses.jsonl").read_text())
        note = json.loads((out / "mpmworlds.json").read_text())
        assert note["made_of"]["processes"] == 2
    assert weights[0] == weights[1]
    assert len(losses) == 1


def test_a_training_that_is_done_is_not_done_again(source, settings, trained):
    before = (trained / WEIGHTS).stat().st_mtime_ns
    assert train(source, settings, trained, progress=False) == trained
    assert (trained / WEIGHTS).stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"rank": 8}, "was trained with rank = 4, asked for is 8; name another --out"),
        ({"seed": 1}, "was trained with seed = 0, asked for is 1"),
    ],
)
def test_another_training_does_not_go_on(source, settings, trained, values, told):
    with pytest.raises(CheckpointError, match=told):
        train(source, changed(settings, **values), trained, progress=False)


def test_weights_that_are_loaded_are_those_that_were_trained(
    settings, pipeline, trained
):
    from accelerate import Accelerator

    run = Run(settings, Accelerator(cpu=True))
    restore(trained / "step-0000004", run.plain, run.optimiser)
    loaded = load_pipeline(pipeline, str(trained), "float32", "cpu", 3.0).transformer
    base = load_pipeline(pipeline, "", "float32", "cpu", 3.0).transformer
    draw = torch.Generator().manual_seed(0)
    seen = {
        "hidden_states": torch.randn(1, 16, 3, 4, 4, generator=draw),
        "control_hidden_states": torch.randn(1, 96, 3, 4, 4, generator=draw),
        "encoder_hidden_states": torch.randn(1, 512, 32, generator=draw),
        "timestep": torch.tensor([500.0]),
        "return_dict": False,
    }
    with torch.no_grad():
        mine, theirs, before = (m.eval()(**seen)[0] for m in (run.plain, loaded, base))
    assert torch.equal(mine, theirs)
    assert not torch.allclose(mine, before)


def test_predictor_takes_over_how_the_lora_was_trained(pipeline, trained):
    told = Vdm(lora=str(trained), steps=2).configuration
    assert (told["chunk"], told["overlap"], told["size"]) == (9, 5, 32)
    assert told["lora_sha256"]
    base = Vdm(str(pipeline), steps=2).configuration
    assert told["checkpoint_sha256"] == base["checkpoint_sha256"]
    assert Vdm(lora=str(trained), overlap=1).configuration["overlap"] == 1


def test_a_lora_is_not_put_on_another_pipeline(trained, tmp_path):
    save_pipeline(tmp_path / "other", seed=1)
    model = Vdm(str(tmp_path / "other"), lora=str(trained))
    with pytest.raises(CheckpointError, match="was trained on checkpoint_sha256"):
        _ = model.configuration


def test_texts_of_another_version_are_told(trained, tmp_path):
    other = shutil.copytree(trained, tmp_path / "other")
    note = json.loads((other / "mpmworlds.json").read_text())
    note["made_of"]["text"] = "mpmworlds-vdm-text/0"
    (other / "mpmworlds.json").write_text(json.dumps(note))
    with pytest.raises(CheckpointError, match="was trained on texts mpmworlds-vdm"):
        _ = Vdm(lora=str(other)).configuration


def test_training_lowers_the_loss(source, settings, tmp_path):
    short = {"chunk": 5, "overlap": 1, "checkpointing": False, "save_every": 24}
    longer = changed(settings, steps=24, learning_rate=0.02, **short)
    out = train(source, longer, tmp_path / "model", progress=False)
    lines = (out / "losses.jsonl").read_text().splitlines()
    losses = [json.loads(line)["loss"] for line in lines]
    assert np.mean(losses[-8:]) < 0.9 * np.mean(losses[:4])


def test_the_loss_is_that_of_the_continuation(pipeline):
    """A model that is wrong on the latents that are given, and only there, has none."""
    pipe = load_pipeline(pipeline, "", "float32", "cpu", 3.0)
    frames = np.random.default_rng(0).integers(0, 256, (9, 32, 32, 3)).astype(np.uint8)
    window = Window(frames, 5, "", 7)
    draw = torch.Generator().manual_seed(window.seed)
    level = noise_level(draw, 3.0)

    def knowing(hidden_states, timestep, **_):
        noise = torch.randn(hidden_states.shape, generator=draw)
        clean = (hidden_states - level * noise) / (1 - level)
        velocity = noise - clean
        velocity[:, :, :2] = 100.0
        assert torch.equal(timestep, level * 1000)
        return (velocity,)

    text = torch.zeros(1, 512, 32)
    loss = continuation_loss(pipe, knowing, window, text, 3.0, torch.float32)
    assert loss < 1e-6


def test_windows_follow_from_their_number_alone(source, settings):
    some = changed(settings, text_dropout=0.5)
    whole = Windows(source, some, 0, 1, 12)
    later = Windows(source, some, 5, 2, 3)
    assert [later[k].seed for k in range(3)] == [whole[k].seed for k in (5, 7, 9)]
    assert np.array_equal(later[1].frames, whole[7].frames)
    texts = [whole[k].text for k in range(12)]
    assert "" in texts
    assert any(text.startswith("gravity") for text in texts)
    assert len({whole[k].frames.tobytes() for k in range(12)}) > 3


def test_too_little_memory_is_told_before_anything_is_read(
    source, settings, tmp_path, monkeypatch
):
    monkeypatch.setattr(devices, "memory_of", lambda device: GIB // 64)
    large = changed(settings, size=256, chunk=81, overlap=37)
    with pytest.raises(TooLittleMemoryError, match=r"training of .*tiny-vace: needs"):
        train(source, large, tmp_path / "model", progress=False)


def test_every_recipe_is_read():
    assert set(TrainingSettings.recipes()) >= {"tiny", "wan-1.3b", "wan-14b"}
    for recipe in TrainingSettings.recipes():
        assert TrainingSettings.read(recipe).chunk % 4 == 1
