"""The text encoder of Wan, apart from its pipeline.

It is a quarter to two thirds of the weights and a small part of the work, so it may
stay on the processor where a GPU is too small for all.
"""

from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import torch
from transformers import AutoTokenizer, UMT5EncoderModel

from mpmworlds.baselines.learned.devices import device_named
from mpmworlds.baselines.vdm.text import MOST_TOKENS

Tensor = torch.Tensor
KEPT: Final = 4  # texts whose states are kept: one of a sample, and none
_TOKENIZER: Final[Any] = AutoTokenizer


class Texts:
    """Texts as the transformer reads them.

    Parameters
    ----------
    folder
        Of a pipeline.
    dtype
        Of the weights of the encoder.
    device
        Where it is.
    """

    def __init__(self, folder: Path, dtype: torch.dtype, device: str) -> None:
        self._tokenizer = _TOKENIZER.from_pretrained(folder, subfolder="tokenizer")
        encoder: Any = UMT5EncoderModel.from_pretrained(
            folder, subfolder="text_encoder", dtype=dtype
        )
        self._encoder = encoder.to(device_named(device)).eval()
        self._encoder.requires_grad_(requires_grad=False)
        self.embedded = lru_cache(KEPT)(self._embedded)

    def count(self, text: str) -> int:
        """Number of tokens of a text, its end among them."""
        return len(self._tokenizer(text).input_ids)

    @torch.no_grad()
    def _embedded(self, text: str) -> Tensor:
        """States (1, MOST_TOKENS, D) of a text, zero after its end.

        As the pipeline makes them, but padded after encoding, in half the time, and
        without its cleaning of web texts, which needs a package of its own (ftfy) and
        has nothing to do on words and numbers in a line.
        """
        tokens = self._tokenizer(
            text, max_length=MOST_TOKENS, truncation=True, return_tensors="pt"
        ).to(self._encoder.device)
        states: Tensor = self._encoder(tokens.input_ids, tokens.attention_mask)[0]
        missing = MOST_TOKENS - states.shape[1]
        return torch.nn.functional.pad(states, (0, 0, 0, missing))
