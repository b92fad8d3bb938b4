"""Parameters are counted exactly, and memory grows with what it depends on."""

from dataclasses import replace

import pytest
from transformers import AutoModelForImageTextToText

from mpmworlds.baselines.vlm.memory import (
    QWEN_7B,
    Shape,
    training_bytes,
    writing_bytes,
)
from mpmworlds.baselines.vlm.writer import read_config

GB = 1e9


def test_parameters_of_a_model_are_counted(checkpoint):
    model = AutoModelForImageTextToText.from_pretrained(checkpoint)
    count = sum(one.numel() for one in model.parameters())
    assert Shape.of(read_config(checkpoint)).parameters == count


def test_parameters_of_the_big_model_are_counted():
    assert QWEN_7B.parameters == 8_292_166_656
    tied = replace(QWEN_7B, tied=True)
    assert QWEN_7B.parameters - tied.parameters == 152064 * 3584


def test_weights_are_most_of_what_one_reply_takes():
    one = writing_bytes(QWEN_7B, "bfloat16", 1, 4000, 8192)
    many = writing_bytes(QWEN_7B, "bfloat16", 15, 4000, 8192)
    assert 16.5 * GB < one < 18.5 * GB
    cache = 14 * 12192 * 2 * 28 * 512 * 2  # of 28 layers with keys of 4 x 128
    assert many - one > cache
    assert (
        writing_bytes(QWEN_7B, "float32", 1, 4000, 8192)
        == 2 * (one - 16 * 152064) + 16 * 152064
    )


@pytest.mark.parametrize(("shards", "most"), [(1, 145), (4, 48), (8, 32)])
def test_shards_share_the_state(shards, most):
    needed = training_bytes(QWEN_7B, shards, 10240)
    assert 16 * QWEN_7B.parameters / shards < needed < most * GB
    assert needed < training_bytes(QWEN_7B, shards, 16384)
