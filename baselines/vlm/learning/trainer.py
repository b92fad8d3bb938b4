"""The trainer of transformers, with a resume that resumes."""

import sys
from typing import Any

from tqdm import tqdm  # type: ignore[import-untyped]
from transformers import (
    PrinterCallback,
    ProgressCallback,
    Trainer,
    TrainerCallback,
)


class ResumingTrainer(Trainer):
    """A `Trainer` whose checkpoints of Qwen2.5-VL load.

    ``save_pretrained`` writes the names of weights that earlier versions had, and
    `Trainer` looks for today's: it finds none, warns, and goes on from what was there
    before [transformers#43701].
    """

    def _load_from_checkpoint(
        self, resume_from_checkpoint: str, model: Any = None
    ) -> None:
        if self.is_fsdp_enabled:  # keeps a copy of its own, under its own names
            super()._load_from_checkpoint(resume_from_checkpoint, model)
            return
        target: Any = self.accelerator.unwrap_model(model or self.model)
        found = type(target).from_pretrained(resume_from_checkpoint, dtype=target.dtype)
        target.load_state_dict(found.state_dict(), strict=True)


class Bar(TrainerCallback):
    """Shows steps and loss on standard error; results alone go to standard output."""

    def __init__(self) -> None:
        self._bar: Any = None

    def on_train_begin(self, args: Any, state: Any, control: Any, **_: Any) -> None:
        """Begin where the training does."""
        self._bar = tqdm(
            total=state.max_steps,
            initial=state.global_step,
            desc="train vlm",
            unit="step",
            file=sys.stderr,
            disable=not state.is_world_process_zero,
        )

    def on_step_end(self, args: Any, state: Any, control: Any, **_: Any) -> None:
        """Count a step."""
        self._bar.update(state.global_step - self._bar.n)

    def on_log(
        self, args: Any, state: Any, control: Any, logs: Any = None, **_: Any
    ) -> None:
        """Show the loss."""
        if logs and "loss" in logs and self._bar is not None:
            self._bar.set_postfix(loss=f"{float(logs['loss']):.4f}", refresh=False)

    def on_train_end(self, args: Any, state: Any, control: Any, **_: Any) -> None:
        """Close the bar."""
        self._bar.close()


def quiet(trainer: Trainer, *, progress: bool) -> None:
    """Take away what prints to standard output, and show a bar if wanted."""
    for callback in (PrinterCallback, ProgressCallback):
        trainer.remove_callback(callback)
    if progress:
        trainer.add_callback(Bar())
