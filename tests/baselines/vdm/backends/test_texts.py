"""Texts as the transformer of Wan reads them."""

import pytest
import torch
from transformers import AutoTokenizer, UMT5EncoderModel

from mpmworlds.baselines.vdm.backends.wan_text import Texts
from mpmworlds.baselines.vdm.text import MOST_TOKENS

LONG = " ".join(["dam"] * 300)


@pytest.fixture(scope="module")
def texts(pipeline):
    return Texts(pipeline, torch.float32, "cpu")


@pytest.mark.parametrize("text", ["", "gravity 0 -9.8", LONG])
def test_states_are_those_of_the_padded_text(texts, pipeline, text):
    """As `WanVACEPipeline` computes them, with a mask, and zeros after the end."""
    tokenizer = AutoTokenizer.from_pretrained(pipeline / "tokenizer")
    encoder = UMT5EncoderModel.from_pretrained(pipeline / "text_encoder")
    padded = tokenizer(
        text,
        padding="max_length",
        max_length=MOST_TOKENS,
        truncation=True,
        return_tensors="pt",
    )
    with torch.no_grad():
        states = encoder(padded.input_ids, padded.attention_mask).last_hidden_state
    expected = states * padded.attention_mask[..., None]
    found = texts.embedded(text)
    assert found.shape == (1, MOST_TOKENS, 32)
    assert torch.allclose(found, expected, atol=1e-5)
    assert not found.requires_grad


def test_tokens_are_counted_beyond_what_is_read(texts):
    assert texts.count(LONG) == 901
    assert texts.count("") == 1
