"""A residual U-Net from labels of frames to logits of the frames that follow."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from mpmworlds.baselines.small.fields import FEATURES
from mpmworlds.baselines.small.settings import TrainingSettings
from mpmworlds.baselines.small.slots import CLASSES

GROUP = 16  # channels of a group that is normalised


@dataclass(frozen=True)
class Shape:
    """What a network is built of."""

    context: int
    """Frames that are seen."""
    horizon: int
    """Frames that are predicted at once."""
    channels: tuple[int, ...]
    """Of each level, the first one at N / patch pixels, each next at half as many."""
    blocks: int
    """Residual blocks of a level, on the way down and on the way up."""
    patch: int
    """Side of the squares of pixels that the first level sees as one."""
    told: int
    """Channels of what a regime tells; 0 for a model that is told nothing."""

    @classmethod
    def of(cls, settings: TrainingSettings, *, told: bool) -> Self:
        """As settings have it, for a model that is told something, or nothing."""
        return cls(
            settings.context,
            settings.horizon,
            settings.channels,
            settings.blocks,
            settings.patch,
            settings.told if told else 0,
        )


class Block(nn.Module):
    """Two convolutions beside an identity; scale and shift by what is told."""

    def __init__(self, width: int, told: int) -> None:
        super().__init__()
        groups = max(1, width // GROUP)
        self.first = nn.Sequential(
            nn.GroupNorm(groups, width),
            nn.SiLU(),
            nn.Conv2d(width, width, 3, padding=1),
        )
        self.norm = nn.GroupNorm(groups, width)
        last = nn.Conv2d(width, width, 3, padding=1)
        nn.init.zeros_(last.weight)
        self.second = nn.Sequential(nn.SiLU(), last)
        self.told = nn.Linear(told, 2 * width) if told else None

    def forward(self, x: Tensor, told: Tensor | None) -> Tensor:
        """(B, C, H, W) -> (B, C, H, W)."""
        y = self.norm(self.first(x))
        if self.told is not None:
            scale, shift = self.told(told)[..., None, None].chunk(2, dim=1)
            y = y * (1 + scale) + shift
        return torch.add(x, self.second(y))


class LabelUNet(nn.Module):
    """Logits of the next frames; at first, that each pixel stays what it is."""

    def __init__(self, shape: Shape) -> None:
        super().__init__()
        self.shape = shape
        area, widths, told = shape.patch**2, shape.channels, shape.told
        self.stem = nn.Conv2d(shape.context * CLASSES * area, widths[0], 1)
        painted = 2 * told + 2  # what is told where a slot is, and where a pixel is
        self.beside = nn.Conv2d(painted, widths[0], 1, bias=False)
        self.fields = (
            nn.Sequential(
                nn.Linear(FEATURES, 4 * told), nn.SiLU(), nn.Linear(4 * told, told)
            )
            if told
            else None
        )
        level = range(shape.blocks)
        self.down = nn.ModuleList(
            nn.ModuleList(Block(width, told) for _ in level) for width in widths
        )
        self.shrink = nn.ModuleList(
            nn.Conv2d(a, b, 2, stride=2) for a, b in pairwise(widths)
        )
        self.grow = nn.ModuleList(nn.Conv2d(b, 4 * a, 1) for a, b in pairwise(widths))
        self.up = nn.ModuleList(
            nn.ModuleList(Block(width, told) for _ in level) for width in widths[:-1]
        )
        self.head = nn.Conv2d(widths[0], shape.horizon * CLASSES * area, 1)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)  # type: ignore[arg-type]
        self.stay = nn.Parameter(torch.tensor(5.0))

    def forward(self, labels: Tensor, fields: Tensor | None = None) -> Tensor:
        """Predict the next frames.

        Parameters
        ----------
        labels
            int64 (B, context, N, N), each below `CLASSES`.
        fields
            float (B, CLASSES, FEATURES), for a model that is told something.

        Returns
        -------
        Tensor
            float (B, horizon, CLASSES, N, N).
        """
        last = _one_hot(labels[:, -1:], self.head.weight.dtype)
        # Labels are shuffled before they are spread over channels: a tenth to move.
        squares = F.pixel_unshuffle(labels, self.shape.patch)
        x = self.stem(_one_hot(squares, self.head.weight.dtype))
        told, painted = self._told(last, fields)
        x = x + self.beside(torch.cat([_places(x), *painted], dim=1))
        kept: list[Tensor] = []
        for level, blocks in enumerate(self.down):
            x = _through(blocks, x, told)
            if level < len(self.shrink):
                kept.append(x)
                x = self.shrink[level](x)
        for level in reversed(range(len(self.up))):
            x = kept[level] + F.pixel_shuffle(self.grow[level](x), 2)
            x = _through(self.up[level], x, told)
        logits = F.pixel_shuffle(self.head(x), self.shape.patch)
        batch, side = labels.shape[0], labels.shape[-1]
        logits = logits.reshape(batch, self.shape.horizon, CLASSES, side, side)
        return logits + self.stay * last[:, None]

    def _told(
        self, last: Tensor, fields: Tensor | None
    ) -> tuple[Tensor | None, Sequence[Tensor]]:
        """What is told of the whole scene, and of each place by the slot there."""
        if self.fields is None:
            return None, ()
        of_slots = self.fields(fields)
        shares = F.avg_pool2d(last, self.shape.patch)
        there = torch.einsum("bcf,bchw->bfhw", of_slots[:, 1:], shares[:, 1:])
        everywhere = of_slots[:, 0, :, None, None].expand_as(there)
        return of_slots.mean(dim=1), (there, everywhere)


def _one_hot(labels: Tensor, dtype: torch.dtype) -> Tensor:
    """(B, T, H, W) -> (B, T CLASSES, H, W)."""
    classes = torch.arange(CLASSES, device=labels.device)[:, None, None]
    return (labels[:, :, None] == classes).to(dtype).flatten(1, 2)


def _through(blocks: Any, x: Tensor, told: Tensor | None) -> Tensor:
    for block in blocks:
        x = block(x, told)
    return x


def _places(x: Tensor) -> Tensor:
    """Coordinates of each pixel, -1 to 1: walls are where the picture ends."""
    rows = torch.linspace(-1, 1, x.shape[2], device=x.device, dtype=x.dtype)
    columns = torch.linspace(-1, 1, x.shape[3], device=x.device, dtype=x.dtype)
    both = torch.stack(torch.meshgrid(rows, columns, indexing="ij"))
    return both.expand(x.shape[0], -1, -1, -1)
