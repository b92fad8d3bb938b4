"""From a prompt to what Qwen2.5-VL reads: tokens, patches of pictures, their grids.

Pictures are shown as pictures, one by one, by the processor that needs Pillow alone:
the one of videos needs torchvision, which has no build for processors without GPU. That
ids, grids and patches are those of transformers' own processor is tested.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import torch
from transformers import AutoTokenizer, Qwen2VLImageProcessorPil

from mpmworlds.baselines.learned.notes import CheckpointError
from mpmworlds.loaders.prompts import Prompt, as_place

PAD: Final = "<|image_pad|>"
TEMPLATE: Final = "chat_template.json"  # where earlier versions keep it


@dataclass(frozen=True, eq=False)
class Encoded:
    """A prompt, or a prompt and its answer."""

    ids: list[int]
    """Tokens."""
    pictures: dict[str, Any]
    """``pixel_values`` (patches, numbers) and ``image_grid_thw`` (pictures, 3)."""


class Encoder:
    """The tokenizer and the processor of pictures of a checkpoint.

    Parameters
    ----------
    folder
        Of the checkpoint.

    Raises
    ------
    CheckpointError
        If it has no template of chats, or no token for pictures.
    """

    def __init__(self, folder: Path) -> None:
        self.tokenizer: Any = AutoTokenizer.from_pretrained(folder)
        self.processor: Any = Qwen2VLImageProcessorPil.from_pretrained(folder)
        if self.tokenizer.chat_template is None and (folder / TEMPLATE).is_file():
            told = json.loads((folder / TEMPLATE).read_text("utf-8"))
            self.tokenizer.chat_template = told["chat_template"]
        pad: Any = self.tokenizer.convert_tokens_to_ids(PAD)
        if self.tokenizer.chat_template is None or pad is None:
            raise CheckpointError(
                f"{folder}: its tokenizer has no chat template, or no {PAD}; name a "
                "checkpoint of Qwen2.5-VL"
            )
        self.pad = int(pad)

    def encode(self, prompt: Prompt) -> Encoded:
        """Tokens and patches of a prompt, up to where the answer begins."""
        return Encoded(self.ids(prompt), self._patches(prompt))

    def encode_with(self, prompt: Prompt, answer: str) -> tuple[Encoded, int]:
        """Those of a prompt and its answer, and the number of tokens of the first.

        Raises
        ------
        ValueError
            If the tokens of the prompt do not stay the same before the answer.
        """
        before, ids = self.ids(prompt), self.ids(prompt, answer)
        if ids[: len(before)] != before:
            raise ValueError(
                "the prompt's tokens are not the first of prompt and answer; the "
                "template of the checkpoint does not suit finetuning"
            )
        return Encoded(ids, self._patches(prompt)), len(before)

    def ids(self, prompt: Prompt, answer: str | None = None) -> list[int]:
        """Tokens; the answer ends with the token that ends a turn."""
        messages = prompt.messages(as_place)
        if answer is not None:
            told = [{"type": "text", "text": answer}]
            messages = [*messages, {"role": "assistant", "content": told}]
        text = self.tokenizer.apply_chat_template(
            messages, add_generation_prompt=answer is None, tokenize=False
        )
        if answer is not None:
            text = text.rstrip("\n")  # the template's, after the end of the turn
        counts = iter([self._tokens_of(p.frame.shape) for p in prompt.pictures])
        first, *rest = text.split(PAD)
        parts = [first, *(PAD * next(counts) + part for part in rest)]
        found = self.tokenizer("".join(parts), add_special_tokens=False)
        return list(found["input_ids"])

    def decode(self, ids: Sequence[int]) -> str:
        """Text of tokens, without the special ones."""
        return str(self.tokenizer.decode(ids, skip_special_tokens=True))

    def _tokens_of(self, shape: Sequence[int]) -> int:
        """Tokens that a picture (H, W, 3) takes."""
        patches = int(self.processor.get_number_of_image_patches(*shape[:2], {}))
        return patches // int(self.processor.merge_size) ** 2

    def _patches(self, prompt: Prompt) -> dict[str, Any]:
        if not prompt.pictures:
            return {}
        frames = [picture.frame for picture in prompt.pictures]
        return dict(self.processor(images=frames, return_tensors="pt"))


def inputs_of(encoded: Encoded, pad: int) -> dict[str, Any]:
    """Arguments of the model for one prompt, as a batch of one.

    Parameters
    ----------
    encoded
        The prompt.
    pad
        Token that stands for a part of a picture.
    """
    ids = torch.tensor([encoded.ids])
    return {
        "input_ids": ids,
        "attention_mask": torch.ones_like(ids),
        "mm_token_type_ids": (ids == pad).long(),
        **encoded.pictures,
    }
