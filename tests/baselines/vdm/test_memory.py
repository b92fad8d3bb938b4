"""Estimates of memory."""

import pytest
import torch
from diffusers import WanVACEPipeline, WanVACETransformer3DModel
from peft import LoraConfig

from mpmworlds.baselines.vdm.backends.wan_pipeline import configs_of, parameters_of
from mpmworlds.baselines.vdm.lora.run import TARGETS
from mpmworlds.baselines.vdm.memory import (
    Clip,
    inference_bytes,
    kept_in_block,
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


def kept_for_gradients(shape, clip, rank):
    """Bytes that autograd keeps of a forward pass, weights left out."""
    model = WanVACETransformer3DModel(**shape).to(torch.bfloat16)
    for name, weight in model.named_parameters():  # as `from_pretrained` has them
        if "norm" in name or "scale_shift" in name or "time_embedder" in name:
            weight.data = weight.data.float()
    model.requires_grad_(requires_grad=False)
    model.add_adapter(LoraConfig(r=rank, target_modules=list(TARGETS)))
    for weight in model.parameters():
        if weight.requires_grad:
            weight.data = weight.data.float()
    weights = {weight.untyped_storage().data_ptr() for weight in model.parameters()}
    kept = {}

    def keep(tensor):
        kept[tensor.untyped_storage().data_ptr()] = tensor  # alive, so none is reused
        return tensor

    frames, side = (clip.frames - 1) // 4 + 1, clip.height // 8
    with torch.autograd.graph.saved_tensors_hooks(keep, lambda tensor: tensor):
        out = model(
            hidden_states=torch.zeros(1, 16, frames, side, side, dtype=torch.bfloat16),
            timestep=torch.tensor([500.0]),
            encoder_hidden_states=torch.zeros(1, 512, 64, dtype=torch.bfloat16),
            control_hidden_states=torch.zeros(
                1, 96, frames, side, side, dtype=torch.bfloat16
            ),
        )
    assert out.sample.requires_grad
    return sum(
        tensor.untyped_storage().nbytes()
        for place, tensor in kept.items()
        if place not in weights
    )


@pytest.mark.parametrize(("heads", "ffn", "rank"), [(2, 512, 8), (1, 1024, 32)])
def test_what_a_block_keeps_for_its_gradient_is_as_counted(heads, ffn, rank):
    clip = Clip(9, 96, 96)
    shape = {
        "num_attention_heads": heads,
        "attention_head_dim": 128,
        "text_dim": 64,
        "ffn_dim": ffn,
        "vace_layers": [0],
    }
    one, three = (
        kept_for_gradients({**shape, "num_layers": layers}, clip, rank)
        for layers in (1, 3)
    )
    expected = kept_in_block(shape, clip, rank)
    assert (three - one) / 2 == pytest.approx(expected, rel=0.1)
