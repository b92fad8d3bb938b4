"""The loss of some frames after others, and how right they are where things move."""

from collections.abc import Iterator

import torch
from torch import Tensor, nn

from mpmworlds.baselines.small.rollout import advanced
from mpmworlds.baselines.small.slots import CLASSES


def unrolled(
    network: nn.Module,
    labels: Tensor,
    fields: Tensor | None,
    context: int,
    changed_weight: float,
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Losses of a window, predicted one horizon after another.

    What was predicted is what is seen next, as it is when a clip is continued; no
    gradient goes through it [Brandstetter et al. 2022, the pushforward trick], so that
    one horizon at a time is in memory.

    Parameters
    ----------
    network
        A `LabelUNet`, perhaps wrapped.
    labels
        int64 (B, context + k horizon, N, N); what is no class is not learned, and seen
        as background.
    fields
        float (B, CLASSES, FEATURES), or None.
    context
        Frames that are seen.
    changed_weight
        Weight of pixels that are not what they were when last seen; others have 1.

    Yields
    ------
    tuple of Tensor
        Loss; how many pixels changed; how many of these were predicted. Scalars.
    """
    known = labels < CLASSES
    clean = torch.where(known, labels, 0)
    seen = clean[:, :context]
    start = context
    while start < labels.shape[1]:
        logits = network(seen, fields)
        stop = start + logits.shape[1]
        target, there = clean[:, start:stop], known[:, start:stop]
        # Seen truly, even where the prediction went astray: that is to be mended, too.
        changed = there & (target != clean[:, start - 1 : start])
        weight = there + (changed_weight - 1.0) * changed
        # Gathered, since the backward pass of cross_entropy in two dimensions is not
        # the same twice on a GPU.
        told = torch.log_softmax(logits.float(), dim=2)
        cost = -told.gather(2, target[:, :, None])[:, :, 0]
        loss = (weight * cost).sum() / weight.sum().clamp_min(1.0)
        new = logits.detach().max(dim=2).indices  # a quarter of the time of argmax
        right = (changed & (new == target)).sum()
        yield loss, changed.sum(), right
        seen = advanced(seen, new)
        start = stop
