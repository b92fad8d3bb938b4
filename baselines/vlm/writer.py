"""A checkpoint that is loaded, and writes replies."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import torch
from transformers import AutoConfig, AutoModelForImageTextToText

from mpmworlds.baselines.learned.devices import check_fits, device_named
from mpmworlds.baselines.learned.notes import CheckpointError
from mpmworlds.baselines.learned.writing import seed_of
from mpmworlds.baselines.protocol import InfrastructureError
from mpmworlds.baselines.vlm.encoding import Encoder, inputs_of
from mpmworlds.baselines.vlm.memory import BYTES, Shape, writing_bytes
from mpmworlds.baselines.vlm.sampling import Sampling
from mpmworlds.loaders.prompts import Prompt

FAMILY: Final = "qwen2_5_vl"
PROMPT_TOKENS: Final = 3500  # of the longest prompts, see benchmarks/vlm.md


@dataclass(frozen=True)
class Reply:
    """What a model wrote."""

    text: str
    whole: bool
    """Whether it came to its end, and was not cut off."""


@dataclass(frozen=True)
class Where:
    """Where a model is loaded, and in which precision."""

    device: str = "auto"
    """As `device_named` takes it."""
    device_map: str = ""
    """How to spread it over several GPUs, as accelerate has it, such as ``auto``; on
    `device` alone if empty."""
    dtype: str = "auto"
    """A key of `BYTES`; ``auto`` is bfloat16 on GPUs, else float32."""

    def resolved(self) -> tuple[Any, str]:
        """Device and name of the type of numbers; raises if they are not there."""
        device = device_named(self.device)
        auto = "bfloat16" if device.type == "cuda" else "float32"
        dtype = auto if self.dtype == "auto" else self.dtype
        if dtype not in BYTES:
            raise ValueError(f"dtype = {dtype!r}, must be auto or one of {list(BYTES)}")
        return device, dtype


def read_config(folder: Path) -> Any:
    """The configuration of a checkpoint of the family.

    Raises
    ------
    CheckpointError
        If it is of another family, or cannot be read.
    """
    try:
        config = AutoConfig.from_pretrained(folder)
    except (OSError, ValueError) as error:
        said = str(error).strip().splitlines()[0]
        raise CheckpointError(f"{folder}: is no checkpoint ({said})") from error
    if config.model_type != FAMILY:
        raise CheckpointError(
            f"{folder}: is a model {config.model_type}, must be {FAMILY}; serve others "
            "by a server such as vLLM, and take the predictor 'served'"
        )
    return config


def check_memory(folder: Path, where: Where, how: Sampling) -> None:
    """Raise before anything is loaded that would not fit."""
    device, dtype = where.resolved()
    if where.device_map:
        return  # what all GPUs together have is for accelerate to share out
    shape = Shape.of(read_config(folder))
    at_once = min(how.samples_per_call, how.candidates)
    needed = writing_bytes(shape, dtype, at_once, PROMPT_TOKENS, how.max_new_tokens)
    least = writing_bytes(shape, dtype, 1, PROMPT_TOKENS, how.max_new_tokens)
    check_fits(
        f"{folder}: {at_once} replies at once in {dtype}",
        needed,
        device,
        f"samples_per_call=1 needs {least / 2**30:.0f} GiB, device_map=auto spreads it "
        "over several GPUs, and the predictor 'served' asks one that runs elsewhere",
    )


class Writer:
    """A model that is loaded.

    Parameters
    ----------
    folder
        Of its checkpoint.
    where
        Where it is loaded.
    """

    def __init__(self, folder: Path, where: Where) -> None:
        device, dtype = where.resolved()
        self._encoder = Encoder(folder)
        if read_config(folder).image_token_id != self._encoder.pad:
            raise CheckpointError(
                f"{folder}: its model and its tokenizer have other tokens for pictures"
            )
        placed = {"device_map": where.device_map} if where.device_map else {}
        model: Any = AutoModelForImageTextToText.from_pretrained(
            folder, dtype=getattr(torch, dtype), **placed
        )
        self._model = model.eval() if where.device_map else model.to(device).eval()
        self._ends = _ends(self._model, self._encoder.tokenizer)

    def replies(self, prompt: Prompt, how: Sampling, name: str) -> list[Reply]:
        """Draw replies to a prompt.

        The same seed, name and settings draw the same on the same machine, whatever
        else was drawn before; other kernels and batches round otherwise.

        Parameters
        ----------
        prompt
            What is asked.
        how
            How they are drawn.
        name
            Of the question, which decides what is drawn for it.

        Raises
        ------
        InfrastructureError
            If memory runs out.
        """
        encoded = self._encoder.encode(prompt)
        inputs = inputs_of(encoded, self._encoder.pad)
        device = self._model.device
        inputs = {key: value.to(device) for key, value in inputs.items()}
        found: list[Reply] = []
        for number, count in enumerate(how.calls()):
            with _seeded(seed_of(how.seed, name, str(number))), _memory_runs_out(how):
                drawn = self._model.generate(
                    **inputs, **self._settings(how), num_return_sequences=count
                )
            new = drawn[:, len(encoded.ids) :].tolist()
            found += [read_ids(ids, self._ends, self._encoder) for ids in new]
        return found

    def _settings(self, how: Sampling) -> dict[str, Any]:
        """All that checkpoints have opinions on, and how it is here."""
        drawn: dict[str, Any] = {"do_sample": False}
        drawn |= dict.fromkeys(("temperature", "top_p", "top_k"))
        if how.temperature > 0:
            drawn = {"do_sample": True, "temperature": how.temperature}
            drawn |= {"top_p": how.top_p, "top_k": 0}
        return drawn | {
            "max_new_tokens": how.max_new_tokens,
            # Code repeats itself: what discourages it in chats breaks programs.
            "repetition_penalty": 1.0,
            "eos_token_id": self._ends,
            "pad_token_id": self._encoder.tokenizer.pad_token_id,
        }


def read_ids(ids: Sequence[int], ends: Collection[int], encoder: Encoder) -> Reply:
    """The reply in tokens that a model drew, up to one that ends it."""
    end = next((place for place, token in enumerate(ids) if token in ends), None)
    return Reply(encoder.decode(ids[:end]), end is not None)


def _ends(model: Any, tokenizer: Any) -> list[int]:
    """Tokens that end a reply."""
    known = model.generation_config.eos_token_id
    ends = {
        tokenizer.eos_token_id,
        *([known] if isinstance(known, int) else known or ()),
    }
    return sorted(token for token in ends if token is not None)


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Draw by a seed, and leave what others draw as it was."""
    with torch.random.fork_rng(devices=range(torch.cuda.device_count())):
        torch.manual_seed(seed)
        yield


@contextmanager
def _memory_runs_out(how: Sampling) -> Iterator[None]:
    """It is no sample's fault."""
    try:
        yield
    except torch.OutOfMemoryError as error:
        said = str(error).splitlines()[0]
        raise InfrastructureError(
            f"samples_per_call = {how.samples_per_call}: {said}; lower it"
        ) from error
