"""What the model reads: as transformers' own processor has it, without torchvision."""

import json
import shutil

import numpy as np
import pytest
import torch
from transformers import AutoTokenizer

from mpmworlds.baselines.learned.notes import CheckpointError
from mpmworlds.baselines.learned.writing import question
from mpmworlds.baselines.protocol import Task
from mpmworlds.baselines.vlm.encoding import PAD, Encoder, inputs_of
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.loaders.regimes import REGIMES


def task_of(side, regime="frames_only", told=""):
    rng = np.random.default_rng(side)
    prefix = rng.integers(0, 256, (38, side, side, 3), np.uint8)
    form = VideoForm(300, 30, 512)
    return Task("0" * 16, prefix, told, regime, 112, 15, form)


@pytest.fixture(scope="module")
def encoder(checkpoint):
    return Encoder(checkpoint)


@pytest.mark.parametrize(("side", "tokens"), [(64, 4), (256, 81)])
@pytest.mark.parametrize("pictures", [2, 8])
def test_each_picture_has_its_tokens_where_it_is_shown(encoder, side, tokens, pictures):
    encoded = encoder.encode(question(task_of(side), pictures, "program", schema=False))
    ids = np.array(encoded.ids)
    grids = encoded.pictures["image_grid_thw"]
    assert (
        grids.tolist() == [[1, int(2 * tokens**0.5), int(2 * tokens**0.5)]] * pictures
    )
    assert len(encoded.pictures["pixel_values"]) == 4 * tokens * pictures
    at = np.flatnonzero(ids == encoder.pad)
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    assert [len(run) for run in runs] == [tokens] * pictures
    start, end = encoder.tokenizer.convert_tokens_to_ids(
        ["<|vision_start|>", "<|vision_end|>"]
    )
    assert all(ids[run[0] - 1] == start and ids[run[-1] + 1] == end for run in runs)


@pytest.mark.parametrize("regime", REGIMES)
def test_what_a_regime_tells_is_read_after_the_pictures(encoder, regime):
    told = "" if REGIMES[regime].blind else "grid_resolution: 128"
    encoded = encoder.encode(
        question(task_of(64, regime, told), 2, "program", schema=False)
    )
    text = encoder.tokenizer.decode(encoded.ids)
    assert text.startswith("<|im_start|>system\n")
    assert text.endswith("Write the program.\n<|im_end|>\n<|im_start|>assistant\n")
    assert (f"\n{told}\nWrite" in text.rpartition("<|vision_end|>")[2]) or not told
    assert "t = 0.000 s\n<|vision_start|>" in text


def test_ids_and_patches_are_those_of_the_own_processor(encoder, checkpoint):
    """`Qwen2_5_VLProcessor` needs torchvision at its making, not for pictures."""
    from transformers import Qwen2_5_VLProcessor

    class Pictures(Qwen2_5_VLProcessor):
        def __init__(self, images, tokenizer):
            self.image_processor, self.tokenizer = images, tokenizer
            self.video_processor = None
            self.chat_template = tokenizer.chat_template
            self.image_token, self.image_token_id = PAD, encoder.pad
            self.video_token = "<|video_pad|>"
            self.video_token_id = tokenizer.convert_tokens_to_ids(self.video_token)

    asked = question(task_of(256), 3, "program", schema=False)
    tokenizer = AutoTokenizer.from_pretrained(checkpoint)
    shown = [picture.frame for picture in asked.pictures]
    text = tokenizer.apply_chat_template(
        asked.messages(lambda _: {"type": "image"}),
        add_generation_prompt=True,
        tokenize=False,
    )
    own = Pictures(encoder.processor, tokenizer)(
        text=[text], images=shown, return_tensors="pt"
    )
    ours = inputs_of(encoder.encode(asked), encoder.pad)
    assert torch.equal(own["input_ids"], ours["input_ids"])
    assert torch.equal(own["image_grid_thw"], ours["image_grid_thw"])
    assert torch.equal(own["mm_token_type_ids"], ours["mm_token_type_ids"])
    torch.testing.assert_close(own["pixel_values"], ours["pixel_values"])


def test_a_model_may_be_shown_nothing(encoder):
    encoded = encoder.encode(question(task_of(64), 0, "program", schema=False))
    assert encoded.pictures == {}
    assert encoder.pad not in encoded.ids
    assert "You are shown none of them." in encoder.tokenizer.decode(encoded.ids)


def test_a_prompt_is_the_beginning_of_prompt_and_answer(encoder):
    asked = question(task_of(64), 2, "program", schema=False)
    encoded, count = encoder.encode_with(asked, "```python\nx\n```")
    assert encoded.ids[:count] == encoder.ids(asked)
    assert encoder.decode(encoded.ids[count:]) == "```python\nx\n```"


def test_a_template_that_changes_the_prompt_is_refused(checkpoint, tmp_path):
    folder = shutil.copytree(checkpoint, tmp_path / "checkpoint")
    (folder / "chat_template.jinja").write_text(
        "{{ messages | length }}{% for m in messages %}{% for c in m['content'] %}"
        "{% if c['type'] == 'image' %}<|image_pad|>{% else %}{{ c['text'] }}{% endif %}"
        "{% endfor %}{% endfor %}"
    )
    asked = question(task_of(64), 2, "program", schema=False)
    with pytest.raises(ValueError, match="does not suit finetuning"):
        Encoder(folder).encode_with(asked, "x")


def test_a_template_is_found_where_earlier_versions_keep_it(checkpoint, tmp_path):
    folder = shutil.copytree(checkpoint, tmp_path / "checkpoint")
    template = (folder / "chat_template.jinja").read_text()
    (folder / "chat_template.jinja").unlink()
    with pytest.raises(CheckpointError, match="no chat template"):
        Encoder(folder)
    told = json.dumps({"chat_template": template})
    (folder / "chat_template.json").write_text(told)
    asked = question(task_of(64), 2, "program", schema=False)
    assert Encoder(folder).ids(asked) == Encoder(checkpoint).ids(asked)
