"""The truth through the encoder of videos."""

import shutil

import numpy as np
import pytest
import torch
from diffusers import AutoencoderKLWan

from mpmworlds.baselines.protocol import Answers, Oracle
from mpmworlds.baselines.vdm.predictor import Vae
from tests.baselines.vdm.tiny import task_of


@pytest.fixture(scope="module")
def vae(pipeline):
    return Vae(str(pipeline))


@pytest.mark.parametrize(("side", "horizon"), [(32, 7), (20, 4), (32, 1)])
def test_all_frames_come_back_in_their_size(vae, side, horizon):
    task = task_of(side=side, horizon=horizon)
    truth = np.zeros((horizon, side, side, 3), np.uint8)
    (answer,) = vae.reveal(task, Answers({}, truth))
    assert answer.continuation.shape == truth.shape
    assert answer.continuation.dtype == np.uint8


def test_it_is_an_oracle_whose_answer_is_that_of_the_encoder(vae, pipeline):
    """What comes back is decoded from nothing but the truth and the frame before."""
    task = task_of(horizon=8)
    truth = task_of("b", horizon=8).prefix[[0, 1, 2, 3, 3, 2, 1, 0]]
    (answer,) = vae.reveal(task, Answers({}, truth))
    frames = np.concatenate([task.prefix[-1:], truth])
    video = torch.from_numpy(frames).permute(3, 0, 1, 2)[None] / 127.5 - 1
    encoder = AutoencoderKLWan.from_pretrained(pipeline, subfolder="vae")
    with torch.no_grad():
        back = encoder(video).sample[0, :, 1:].clamp(-1, 1)
    expected = ((back + 1) * 127.5).round().permute(1, 2, 3, 0).numpy()
    assert np.abs(answer.continuation.astype(int) - expected).max() <= 1
    assert isinstance(vae, Oracle)


def test_configuration_is_that_of_the_encoder_alone(vae, pipeline, tmp_path):
    other = shutil.copytree(pipeline, tmp_path / "other")
    (weights,) = (other / "transformer").glob("*.safetensors")
    weights.write_bytes(b"others")
    assert Vae(str(other)).configuration == vae.configuration
