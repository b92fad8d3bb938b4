"""A random WanVACE pipeline, saved as the real ones are, and tasks for it."""

import numpy as np
import torch
from diffusers import (
    AutoencoderKLWan,
    FlowMatchEulerDiscreteScheduler,
    WanVACEPipeline,
    WanVACETransformer3DModel,
)
from tokenizers import Tokenizer, models, pre_tokenizers, processors
from transformers import PreTrainedTokenizerFast, UMT5Config, UMT5EncoderModel

from mpmworlds.baselines.protocol import Task
from mpmworlds.loaders.prompts import VideoForm

LETTERS = "abcdefghijklmnopqrstuvwxyz0123456789.-;#"


def tokenizer():
    """One token for each letter, digit and sign, and an end, as UMT5 has it."""
    special = ["<pad>", "</s>", "<unk>"]
    pieces = [*special, *(f"▁{c}" for c in LETTERS), *LETTERS, "▁"]
    inner = Tokenizer(models.Unigram([(p, -1.0) for p in pieces], unk_id=2))
    inner.pre_tokenizer = pre_tokenizers.Metaspace()
    inner.post_processor = processors.TemplateProcessing(
        single="$A </s>", special_tokens=[("</s>", 1)]
    )
    return PreTrainedTokenizerFast(
        tokenizer_object=inner,
        pad_token="<pad>",
        eos_token="</s>",
        unk_token="<unk>",
    )


def save_pipeline(folder, seed=0):
    """Write a pipeline whose parts have the layout of Wan2.1-VACE."""
    torch.manual_seed(seed)
    words = tokenizer()
    encoder = UMT5EncoderModel(
        UMT5Config(
            vocab_size=len(words),
            d_model=32,
            d_kv=8,
            d_ff=37,
            num_layers=2,
            num_heads=4,
        )
    )
    vae = AutoencoderKLWan(
        base_dim=4,
        z_dim=16,
        dim_mult=[1, 1, 1, 1],
        num_res_blocks=1,
        temperal_downsample=[False, True, True],
    )
    transformer = WanVACETransformer3DModel(
        num_attention_heads=2,
        attention_head_dim=12,
        text_dim=32,
        freq_dim=16,
        ffn_dim=32,
        num_layers=3,
        rope_max_seq_len=32,
        vace_layers=[0, 2],
        vace_in_channels=96,
    )
    with torch.no_grad():  # the control branch of a fresh model adds nothing
        for block in transformer.vace_blocks:
            torch.nn.init.normal_(block.proj_out.weight, std=0.2)
    WanVACEPipeline(
        tokenizer=words,
        text_encoder=encoder,
        vae=vae,
        scheduler=FlowMatchEulerDiscreteScheduler(shift=5.0),
        transformer=transformer,
    ).save_pretrained(folder)


def task_of(name="a", side_info="", side=32, prefix=6, horizon=7):
    levels = np.random.default_rng(0).integers(0, 256, (prefix, side, side, 3))
    form = VideoForm(prefix + horizon, 15, side)
    frames = levels.astype(np.uint8)
    return Task(name, frames, side_info, "frames_only", horizon, 15, form)
