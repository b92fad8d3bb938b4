"""Frame after frame: what a network predicts becomes what it sees.

Where a network doubts which pixel a moving edge will take, each of them is most likely
background, and things that move wear away. Matter does not: what a slot was seen to
cover is a bound from below, to which the most likely labels are held.
"""

from typing import Final

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from mpmworlds.baselines.small.fields import Fields
from mpmworlds.baselines.small.network import LabelUNet
from mpmworlds.baselines.small.slots import CLASSES, LabelFrames

ROUNDS: Final = 6  # of raising what covers too little
DAMPING: Final = 0.7  # of a raise; 1 overshoots where edges are sharp
MOST: Final = 2.0  # a raise at most: what has vanished comes back by and by


@torch.inference_mode()
def continued(
    network: LabelUNet,
    begun: LabelFrames,
    count: int,
    fields: Fields | None = None,
    kept: float = 0.0,
) -> LabelFrames:
    """Continue labels of frames, each pixel as what is most likely.

    Parameters
    ----------
    network
        Where it lies, there it runs.
    begun
        uint8 (T, N, N), T >= 1, each below `CLASSES`; of fewer frames than the network
        sees the first is repeated.
    count
        How many frames are wanted.
    fields
        float32 (CLASSES, FEATURES), for a network that is told something.
    kept
        Part of the area that each slot had in the last frames seen, which it does not
        fall below; 0 for no bound.

    Returns
    -------
    ndarray
        uint8 (count, N, N).
    """
    shape, device = network.shape, network.stay.device
    side = begun.shape[-1]
    seen = np.concatenate([begun[:1].repeat(shape.context, axis=0), begun])
    context = torch.from_numpy(seen[-shape.context :]).to(device).long()[None]
    context = padded(context, network)
    told = None if fields is None else torch.from_numpy(fields).to(device)[None]
    areas = kept * areas_of(context).mean(dim=1, keepdim=True)
    found: list[Tensor] = []
    for _ in range(-(-count // shape.horizon)):
        new = held(network(context, told), areas)
        context = advanced(context, new)
        found.append(new[0, :, :side, :side].to(torch.uint8))
    if not found:
        return begun[:0]
    labels: LabelFrames = torch.cat(found)[:count].cpu().numpy()
    return labels


def held(logits: Tensor, areas: Tensor) -> Tensor:
    """The most likely labels of which each slot covers at least some area.

    Slots that cover too little are raised, all of their pixels alike, so that they gain
    those that were nearly theirs.

    Parameters
    ----------
    logits
        float (B, T, CLASSES, N, N).
    areas
        float (B, 1, CLASSES), in pixels; that of background is no bound.

    Returns
    -------
    Tensor
        int64 (B, T, N, N).
    """
    labels = logits.max(dim=2).indices
    raised = torch.zeros(logits.shape[:3], device=logits.device)
    for _ in range(ROUNDS):
        there = areas_of(labels)
        if not (there < areas)[..., 1:].any():
            break
        short = torch.log((areas + 1) / (there + 1)).clamp(-MOST / 4, MOST)
        raised = (raised + DAMPING * short).clamp_min(0)
        raised[..., 0] = 0
        labels = (logits + raised[..., None, None]).max(dim=2).indices
    return labels


def areas_of(labels: Tensor) -> Tensor:
    """Pixels of each class: (B, T, N, N) -> float (B, T, CLASSES)."""
    counts = [(labels == number).sum(dim=(-2, -1)) for number in range(CLASSES)]
    return torch.stack(counts, dim=-1).float()


def advanced(context: Tensor, new: Tensor) -> Tensor:
    """The frames that are seen next: the last ones, as many as before."""
    return torch.cat([context, new], dim=1)[:, -context.shape[1] :]


def padded(labels: Tensor, network: LabelUNet) -> Tensor:
    """Labels (B, T, N, N) with background on the right and below, to halve evenly."""
    shape = network.shape
    multiple = shape.patch * 2 ** (len(shape.channels) - 1)
    short = -labels.shape[-1] % multiple
    return F.pad(labels, (0, short, 0, short))
