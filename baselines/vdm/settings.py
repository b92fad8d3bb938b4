"""Settings of the training of a LoRA."""

from typing import Self

from pydantic import Field, model_validator

from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.baselines.vdm.chunks import check_lengths


class TrainingSettings(Settings):
    """Settings of a training; those of a call are taken over by the predictor."""

    checkpoint: str = "Wan-AI/Wan2.1-VACE-1.3B-diffusers"
    """Folder of a WanVACE pipeline, or its name on the Hub."""
    revision: str = ""
    """Version of a repository on the Hub; its newest one if empty."""
    chunk: int = 81
    """Frames of a window, 4 k + 1; fewer of shorter clips."""
    overlap: int = 37
    """Frames of it that are given, 4 k + 1."""
    size: int | None = None
    """Side that frames are resized to [px]; their own, rounded up, if null."""
    rank: int = Field(32, ge=1)
    """Of the LoRA, whose scale is 1."""
    steps: int = Field(4000, ge=1)
    """Steps of the optimiser."""
    batch: int = Field(4, ge=1)
    """Windows of a step, of each process; one after another, as the pipeline has it."""
    learning_rate: float = Field(1e-4, gt=0)
    """Of AdamW, after warming up; then constant, so that a training can go on."""
    warmup: int = Field(100, ge=0)
    """Steps until the learning rate is reached."""
    weight_decay: float = Field(0.01, ge=0)
    """Of AdamW."""
    clip_norm: float = Field(1.0, gt=0)
    """Longest gradient."""
    shift: float = Field(3.0, gt=0)
    """Shift of the noise levels, which are logit-normal."""
    text_dropout: float = Field(0.1, ge=0, le=1)
    """Share of windows without a text, for classifier-free guidance."""
    checkpointing: bool = True
    """Whether activations are computed again in the backward pass, for less memory."""
    save_every: int = Field(250, ge=1)
    """Steps from one checkpoint to the next."""
    seed: int = Field(0, ge=0)
    """Of all that is drawn."""
    workers: int = Field(2, ge=0)
    """Processes that decode, for each process that trains; changes no result."""
    dtype: str = "auto"
    """Of the frozen weights; the LoRA is float32."""
    device: str = "auto"
    """Of a single process."""
    text_device: str = ""
    """Where texts are encoded, `cpu` to save memory; as the rest if empty."""

    @model_validator(mode="after")
    def _lengths(self) -> Self:
        check_lengths(self.chunk, self.overlap)
        return self
