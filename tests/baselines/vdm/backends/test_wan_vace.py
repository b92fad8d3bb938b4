"""The predictor on a random pipeline of Wan2.1-VACE."""

import json
import logging
import shutil

import numpy as np
import pytest
import torch

from mpmworlds.baselines.learned import devices
from mpmworlds.baselines.learned.devices import GIB, TooLittleMemoryError
from mpmworlds.baselines.learned.extras import MissingExtraError
from mpmworlds.baselines.protocol import InfrastructureError
from mpmworlds.baselines.vdm import predictor
from mpmworlds.baselines.vdm.backends import wan_vace
from mpmworlds.baselines.vdm.backends.wan_pipeline import load_pipeline, masked
from mpmworlds.baselines.vdm.chunks import plan_chunks
from mpmworlds.baselines.vdm.predictor import Vdm
from tests.baselines.vdm.tiny import save_pipeline, task_of

PROTOCOL = plan_chunks(38, 112, wan_vace.CHUNK, wan_vace.OVERLAP)
SMALL = {"steps": 2, "chunk": 9, "overlap": 5}


@pytest.fixture(scope="module")
def model(pipeline):
    return Vdm(str(pipeline), **SMALL)


@pytest.fixture(scope="module")
def continued(model):
    """What is continued in two chunks."""
    return model.predict(task_of())[0].continuation


def test_continuation_has_the_horizon_and_the_size(continued):
    assert continued.shape == (7, 32, 32, 3)
    assert continued.dtype == np.uint8
    assert continued.std() > 1


def test_a_frame_of_any_size_is_taken(model):
    assert model.predict(task_of(side=20, horizon=4))[0].continuation.shape == (
        4,
        20,
        20,
        3,
    )


def test_the_same_task_gives_the_same_frames_whatever_came_before(pipeline, continued):
    other = Vdm(str(pipeline), **SMALL)
    other.predict(task_of("b", horizon=4))
    assert np.array_equal(other.predict(task_of())[0].continuation, continued)


@pytest.mark.parametrize(
    "changed",
    [{"name": "b"}, {"side_info": "gravity: [0.0, -9.8]\n"}],
    ids=["task", "text"],
)
def test_task_and_text_change_the_frames(model, continued, changed):
    other = model.predict(task_of(**changed))[0].continuation
    assert not np.array_equal(other, continued)


def test_seed_and_prefix_change_the_frames(pipeline, continued):
    other = Vdm(str(pipeline), seed=1, **SMALL).predict(task_of())[0].continuation
    assert not np.array_equal(other, continued)


def test_the_prefix_changes_the_frames(model, continued):
    task = task_of()
    task.prefix[:] = 255 - task.prefix
    assert not np.array_equal(model.predict(task)[0].continuation, continued)


def test_what_is_not_read_is_counted(pipeline, caplog):
    model = Vdm(str(pipeline), **SMALL)
    with caplog.at_level(logging.WARNING):
        model.predict(task_of(horizon=4))
        model.predict(task_of(side_info="caption " * 100, horizon=4))
    told = [r.getMessage() for r in caplog.records if "tokens" in r.getMessage()]
    assert len(told) == 1
    assert "the model reads 512; so have 1 of 2 so far" in told[0]


def test_configuration_tells_weights_and_sampling_apart(pipeline, tmp_path):
    told = Vdm(str(pipeline), **SMALL).configuration
    assert json.loads(json.dumps(told)) == told
    assert Vdm(str(pipeline), **SMALL).configuration == told
    assert Vdm(str(pipeline), seed=1, **SMALL).configuration != told
    save_pipeline(tmp_path / "other", seed=1)
    other = Vdm(str(tmp_path / "other"), **SMALL).configuration
    assert other["checkpoint_sha256"] != told["checkpoint_sha256"]
    assert str(pipeline) not in str(told)


@pytest.mark.parametrize(
    ("options", "error", "told"),
    [
        ({"checkpoint": "nowhere"}, OSError, "'nowhere': is no folder, and no OWNER/"),
        ({"checkpoint": "own/er"}, OSError, "own/er: is not here, and the Hub cannot"),
        ({"backend": "sora"}, ValueError, r"backend 'sora': unknown, must be one of"),
        ({"chunk": 24}, ValueError, r"chunk = 24 frames, must be 4 k \+ 1"),
        ({"lora": "nowhere"}, OSError, r"lora nowhere: has 0 files \*.safetensors"),
        ({"dtype": "int8"}, ValueError, "dtype 'int8': is no type of floats"),
        ({"device": "tpu9"}, RuntimeError, "device 'tpu9'"),
    ],
)
def test_what_stands_in_the_way_is_told_before_anything(pipeline, options, error, told):
    model = Vdm(**{"checkpoint": str(pipeline), **SMALL, **options})
    with pytest.raises(error, match=told):
        _ = model.configuration


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_a_gpu_that_is_not_there_is_told(pipeline):
    with pytest.raises(RuntimeError, match=r"'cuda': torch .* sees no GPU; take 'cpu'"):
        _ = Vdm(str(pipeline), device="cuda").configuration


def test_a_package_that_is_not_there_is_told(pipeline, monkeypatch):
    monkeypatch.setattr(predictor, "MODULES", ("torch", "nowhere_at_all"))
    told = r"nowhere_at_all: not installed; pip install 'mpmworlds\[vdm\]'"
    with pytest.raises(MissingExtraError, match=told):
        _ = Vdm(str(pipeline)).configuration


@pytest.mark.parametrize(
    "chunk", plan_chunks(38, 112, wan_vace.CHUNK, wan_vace.OVERLAP)
)
def test_the_mask_calls_new_what_is_not_given(pipeline, chunk):
    pipe = load_pipeline(pipeline, "", "float32", "cpu", 3.0)
    given = np.zeros((chunk.given, 16, 16, 3), np.uint8)
    mask = pipe.prepare_masks(masked(given, chunk.new)[1], [[]])
    of_latents = mask.amax((0, 1, 3, 4)).tolist()
    known = (chunk.given - 1) // 4 + 1
    assert of_latents == [0.0] * known + [1.0] * (chunk.new // 4)


def test_too_little_memory_is_told(pipeline, monkeypatch):
    monkeypatch.setattr(devices, "memory_of", lambda device: GIB // 64)
    with pytest.raises(TooLittleMemoryError, match="take a smaller checkpoint, size"):
        _ = Vdm(str(pipeline)).configuration


def test_another_kind_of_pipeline_is_told(tmp_path):
    (tmp_path / "model_index.json").write_text('{"_class_name": "LTXPipeline"}')
    with pytest.raises(ValueError, match="is a LTXPipeline, must be a WanVACEPipeline"):
        _ = Vdm(str(tmp_path)).configuration


def test_weights_that_cannot_be_read_are_no_failure_of_a_sample(pipeline, tmp_path):
    broken = shutil.copytree(pipeline, tmp_path / "broken")
    (weights,) = (broken / "transformer").glob("*.safetensors")
    weights.write_bytes(b"nonsense")
    with pytest.raises(InfrastructureError, match="wan_vace cannot be loaded"):
        Vdm(str(broken), **SMALL).predict(task_of())
