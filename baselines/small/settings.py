"""Numbers of a training of the label model."""

from typing import Literal

from pydantic import Field

from mpmworlds.baselines.learned.settings import Settings


class TrainingSettings(Settings):
    """What `mpmworlds train small` can be told; recipes have most of it."""

    context: int = Field(8, ge=1)
    """Frames that the network sees."""
    horizon: int = Field(4, ge=1)
    """Frames that it predicts at once."""
    channels: tuple[int, ...] = (48, 96, 192, 256, 384)
    """Of each level, each with half the pixels a side of the one before."""
    blocks: int = Field(2, ge=1)
    """Residual blocks of a level, on the way down and on the way up."""
    patch: int = Field(2, ge=1)
    """Side of the squares of pixels that the first level takes as one."""
    told: int = Field(16, ge=1)
    """Channels of what a regime tells, if it tells something."""
    steps: int = Field(40_000, ge=1)
    """Of the optimiser."""
    batch: int = Field(16, ge=1)
    """Windows of a step, on each device."""
    learning_rate: float = Field(4e-4, gt=0)
    """Of AdamW, at its highest; it goes to 0 as a cosine."""
    warmup: int = Field(500, ge=0)
    """Steps in which the learning rate rises."""
    weight_decay: float = Field(0.01, ge=0)
    """Of AdamW."""
    unroll: int = Field(3, ge=1)
    """Horizons that are predicted one after another at the end of the training."""
    unroll_from: float = Field(0.5, ge=0, le=1)
    """Part of the steps after which more than one is."""
    changed_weight: float = Field(4.0, ge=1)
    """Weight of pixels that change; others have 1."""
    ema: float = Field(0.999, ge=0, lt=1)
    """Decay of the mean of the weights, which is what is kept."""
    held_out: int = Field(8, ge=0)
    """Samples of the split that are not trained on but looked at."""
    log_every: int = Field(50, ge=1)
    """Steps between lines of the log."""
    save_every: int = Field(1000, ge=1)
    """Steps between checkpoints, and looks at what is held out."""
    seed: int = Field(0, ge=0)
    """Of weights and windows."""
    precision: Literal["no", "bf16", "fp16"] = "no"
    """Of the arithmetic, as accelerate names it."""
    workers: int = Field(0, ge=0)
    """Processes that read windows."""
    device: str = "auto"
    """As torch names it; auto is the GPU if there is one."""
