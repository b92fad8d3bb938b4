"""Settings of a finetuning, and names of what it writes."""

from typing import Final

from pydantic import Field

from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.baselines.vlm.places import QWEN
from mpmworlds.loaders.prompts import PICTURES

CHECKPOINTS: Final = "checkpoints"
STATE: Final = "trainer_state.json"  # the last file of a checkpoint
LOG: Final = "log.json"


class TrainingSettings(Settings):
    """Settings of a finetuning; the defaults are those of the recipe ``paper``."""

    checkpoint: str = QWEN
    """What is finetuned: a folder, or a name on the Hub."""
    revision: str = ""
    """Of a repository on the Hub."""
    task: str = Field("program", pattern="^(program|scene)$")
    """What is written."""
    pictures: int = Field(PICTURES, ge=0)
    """Frames of the prefix that are shown."""
    epochs: float = Field(2.0, gt=0)
    """How often samples are seen on average."""
    batch: int = Field(16, ge=1)
    """Samples of a step, over all devices."""
    per_device: int = Field(1, ge=1)
    """Samples that a device computes at once; the rest of a batch is accumulated."""
    learning_rate: float = Field(1e-5, gt=0)
    """At its highest; it falls to 0 as a cosine."""
    warmup: float = Field(0.03, ge=0, lt=1)
    """Share of the steps over which it rises."""
    weight_decay: float = Field(0.0, ge=0)
    """Of AdamW."""
    max_grad_norm: float = Field(1.0, gt=0)
    """Longer gradients are shortened to it."""
    max_tokens: int = Field(10240, ge=1)
    """Samples with more tokens, prompt and answer, are left out, and counted."""
    weighted: bool = False
    """Draw samples by their kinds' weights, which the rows of ``10k`` were drawn by."""
    half: bool = True
    """Compute in bfloat16; weights and moments are float32."""
    checkpointing: bool = True
    """Keep the input of each layer alone, and compute the rest again."""
    save_steps: int = Field(100, ge=1)
    """Steps between checkpoints to go on from."""
    keep: int = Field(2, ge=2)
    """Such checkpoints that are kept; one may be half written when power fails."""
    seed: int = 0
    """Of the order of samples."""
    workers: int = Field(2, ge=0)
    """Processes that decode videos, for each device."""
