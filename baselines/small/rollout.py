"""Frame after frame: what a network predicts becomes what it sees."""

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from mpmworlds.baselines.small.fields import Fields
from mpmworlds.baselines.small.network import LabelUNet
from mpmworlds.baselines.small.slots import LabelFrames


@torch.inference_mode()
def continued(
    network: LabelUNet, begun: LabelFrames, count: int, fields: Fields | None = None
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
    found: list[Tensor] = []
    for _ in range(-(-count // shape.horizon)):
        new = network(context, told).max(dim=2).indices
        context = advanced(context, new)
        found.append(new[0, :, :side, :side].to(torch.uint8))
    if not found:
        return begun[:0]
    labels: LabelFrames = torch.cat(found)[:count].cpu().numpy()
    return labels


def advanced(context: Tensor, new: Tensor) -> Tensor:
    """The frames that are seen next: the last ones, as many as before."""
    return torch.cat([context, new], dim=1)[:, -context.shape[1] :]


def padded(labels: Tensor, network: LabelUNet) -> Tensor:
    """Labels (B, T, N, N) with background on the right and below, to halve evenly."""
    shape = network.shape
    multiple = shape.patch * 2 ** (len(shape.channels) - 1)
    short = -labels.shape[-1] % multiple
    return F.pad(labels, (0, short, 0, short))
