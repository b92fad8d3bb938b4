"""Training samples as Qwen2.5-VL takes them: prompt and answer, in batches."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import torch
from torch.utils.data import Dataset

from mpmworlds.baselines.vlm.encoding import Encoder
from mpmworlds.baselines.vlm.learning.loss import UNSEEN
from mpmworlds.builder.recipes.streams import stream
from mpmworlds.loaders.clips import Clip, Stills, clip_of, sampled
from mpmworlds.loaders.export.sft import question_about
from mpmworlds.loaders.load import Examples
from mpmworlds.loaders.prompts import Prompt, answer_of
from mpmworlds.loaders.weights import sampling_weights
from mpmworlds.metrics.reduction import prefix_length, reduced_framerate, reduced_side

VIDEOS: Final = ("clip", "preview", "video")  # columns that lengths do not depend on
Item = dict[str, Any]


@dataclass(frozen=True)
class Asking:
    """What is asked about a sample."""

    task: str
    """``program`` or ``scene``."""
    pictures: int
    """Frames of the prefix that are shown; 0 for none."""

    def prompt(self, row: Mapping[str, Any], clip: Clip, examples: Examples) -> Prompt:
        """The question about a row, with pictures of a clip."""
        stills = Stills(clip.frames[:0], ())
        if self.pictures:
            stills = sampled(clip, self.pictures)
        return question_about(row, stills, examples.regime, self.task)


class Chats(Dataset[Item]):
    """Prompts with their answers, in the order in which they are trained on.

    Parameters
    ----------
    examples
        Samples of a release.
    order
        Number of the sample of each place.
    encoder, asking
        How they are asked about.
    """

    def __init__(
        self,
        examples: Examples,
        order: npt.NDArray[np.int64],
        encoder: Encoder,
        asking: Asking,
    ) -> None:
        self._examples, self._order = examples, order
        self._encoder, self._asking = encoder, asking

    def __len__(self) -> int:
        return len(self._order)

    def __getitem__(self, place: int) -> Item:
        """Tokens, labels and pictures; labels are `UNSEEN` before the answer."""
        row = self._examples.table[int(self._order[place])]
        clip = clip_of(row, prefix_only=True)
        prompt = self._asking.prompt(row, clip, self._examples)
        answer = answer_of(row, self._asking.task)
        try:
            encoded, asked = self._encoder.encode_with(prompt, answer)
        except ValueError as error:
            raise ValueError(f"{row['id']}: {error}") from None
        labels = [UNSEEN] * asked + encoded.ids[asked:]
        return {"input_ids": encoded.ids, "labels": labels, **encoded.pictures}


def lengths(examples: Examples, encoder: Encoder, asking: Asking) -> Iterator[int]:
    """Tokens of each sample with its answer, without decoding a video."""
    table = examples.table
    table = table.remove_columns([n for n in VIDEOS if n in table.column_names])
    for row in table:
        rate, side = (
            reduced_framerate(row["framerate"]),
            reduced_side(row["resolution"], row["resolution"]),
        )
        blank = np.broadcast_to(np.uint8(0), (prefix_length(rate), side, side, 3))
        prompt = asking.prompt(row, Clip(blank, rate), examples)
        yield len(encoder.ids(prompt, answer_of(row, asking.task)))


def order_of(
    kinds: Sequence[str], count: int, seed: int, *, weighted: bool
) -> npt.NDArray[np.int64]:
    """Which sample is trained on when.

    Parameters
    ----------
    kinds
        Kind of each sample.
    count
        Places of the order.
    seed
        Which draws.
    weighted
        Draw by the weights of `mpmworlds.loaders.weights`, with replacement; else each
        sample once before any comes again.

    Returns
    -------
    ndarray
        int64 (count,). A longer order begins like a shorter one.
    """
    rng = stream(seed, "vlm", "order")
    if weighted:
        weights = np.array(sampling_weights(kinds))
        bounds = np.cumsum(weights / weights.sum())
        return np.minimum(np.searchsorted(bounds, rng.random(count)), len(kinds) - 1)
    rounds = [rng.permutation(len(kinds)) for _ in range(-(-count // len(kinds)))]
    return np.concatenate(rounds)[:count].astype(np.int64)


@dataclass(frozen=True)
class Collator:
    """Puts chats into a batch, padded on the right.

    Logits are computed from where the first answer begins: those of prompts are passed
    over by the loss.
    """

    pad: int
    """Token of padding."""
    picture: int
    """Token that stands for a part of a picture."""

    def __call__(self, items: Sequence[Item]) -> Item:
        """A batch, as the model's arguments."""
        ids = _padded([item["input_ids"] for item in items], self.pad)
        labels = _padded([item["labels"] for item in items], UNSEEN)
        there = _padded([[1] * len(item["input_ids"]) for item in items], 0)
        first = int((labels != UNSEEN).any(0).nonzero()[0])
        kept = labels.shape[1] - (first - 1)  # the token before tells the first one
        batch = {
            "input_ids": ids,
            "attention_mask": there,
            "mm_token_type_ids": (ids == self.picture).long(),
            "labels": labels[:, -kept:].contiguous(),
            "logits_to_keep": kept,
        }
        for name in ("pixel_values", "image_grid_thw"):
            found = [item[name] for item in items if name in item]
            if found:
                batch[name] = torch.cat(found)
        return batch


def _padded(rows: Sequence[Sequence[int]], value: int) -> torch.Tensor:
    tensors = [torch.tensor(row) for row in rows]
    return torch.nn.utils.rnn.pad_sequence(
        tensors, batch_first=True, padding_value=value
    )
