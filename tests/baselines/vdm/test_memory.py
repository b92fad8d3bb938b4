"""Estimates of memory."""

import pytest
from diffusers import WanVACEPipeline
from peft import LoraConfig

from mpmworlds.baselines.vdm.backends.wan_pipeline import configs_of, parameters_of
from mpmworlds.baselines.vdm.lora.run import TARGETS
from mpmworlds.baselines.vdm.memory import (
    Clip,
    inference_bytes,
    lora_parameters,
    training_bytes,
)


@pytest.fixture(scope="module")
def loaded(pipeline):
    return WanVACEPipeline.from_pretrained(pipeline)


@pytest.fixture(scope="module")
def configs(pipeline):
    return configs_of(str(pipeline), "")


def test_weights_are_counted_without_loading_them(loaded, configs):
    for name, count in parameters_of(configs).items():
        assert count == sum(p.numel() for p in getattr(loaded, name).parameters())


def test_weights_of_a_lora_are_counted(loaded, configs):
    loaded.transformer.requires_grad_(requires_grad=False)
    loaded.transformer.add_adapter(LoraConfig(r=4, target_modules=list(TARGETS)))
    weights = [p for p in loaded.transformer.parameters() if p.requires_grad]
    counted = sum(p.numel() for p in weights)
    assert counted == lora_parameters(configs["transformer"], 4)


def test_memory_grows_with_the_clip_and_without_checkpointing(configs):
    parts = parameters_of(configs)
    shapes = configs["transformer"], configs["vae"]
    small, large = Clip(9, 32, 32), Clip(81, 256, 256)
    assert inference_bytes(parts, *shapes, small) < inference_bytes(
        parts, *shapes, large
    )
    kept = training_bytes(parts, *shapes, large, 4, checkpointing=False)
    again = training_bytes(parts, *shapes, large, 4, checkpointing=True)
    assert inference_bytes(parts, *shapes, large) < again <= kept
