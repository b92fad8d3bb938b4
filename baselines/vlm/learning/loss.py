"""The loss of a language model, a chunk of tokens at a time.

At 152,064 words a token, the logits of one program and their gradients take as many
gigabytes as a third of the weights; a chunk's are computed again when they are needed.
"""

from typing import Any

import torch
from torch.nn import functional
from torch.utils.checkpoint import checkpoint

from mpmworlds.baselines.vlm.memory import CHUNK

UNSEEN = -100  # a label that the loss passes over


def chunk_loss(model: Any, size: int = CHUNK) -> None:
    """Have a model in training compute its loss in chunks; it gives no logits then.

    Parameters
    ----------
    model
        Of transformers, with a ``lm_head`` and a ``loss_function``. Names of weights
        and what is learned stay as they are.
    size
        Tokens of a chunk.
    """
    head = model.lm_head

    def summed(hidden: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
        # The weight is looked up here: where it is in shards, the one that is gathered.
        logits = functional.linear(hidden, head.weight).float()
        return functional.cross_entropy(
            logits, labels, ignore_index=UNSEEN, reduction="sum"
        )

    def loss(
        logits: torch.Tensor,
        labels: torch.Tensor,
        num_items_in_batch: Any = None,
        **_: Any,
    ) -> torch.Tensor:
        """As `ForCausalLMLoss`, of what the head was given instead of its logits."""
        hidden = logits[:, :-1].flatten(0, 1)
        told = labels[:, 1:].flatten().to(hidden.device)
        parts = zip(torch.split(hidden, size), torch.split(told, size), strict=True)
        sums = [checkpoint(summed, *part, use_reentrant=False) for part in parts]
        count = (told != UNSEEN).sum()
        if num_items_in_batch is not None:
            count = num_items_in_batch
        return torch.stack(sums).sum() / count

    # A copy: what a sharded model gives out must be no view, which loses its hooks.
    head.forward = lambda hidden: hidden.clone()
    model.loss_function = loss
