"""A model in training: the frozen pipeline, its LoRA, and one step of the optimiser."""

from collections.abc import Iterator
from typing import Any, Final

import torch
from accelerate import Accelerator
from peft import LoraConfig

from mpmworlds.baselines.vdm.backends.wan_pipeline import (
    ADAPTER,
    dtype_named,
    folder_of,
    load_pipeline,
)
from mpmworlds.baselines.vdm.backends.wan_text import Texts
from mpmworlds.baselines.vdm.lora.loss import continuation_loss
from mpmworlds.baselines.vdm.lora.windows import Window
from mpmworlds.baselines.vdm.settings import TrainingSettings

# Both attentions and the layers behind them, of all blocks, those of control as well.
TARGETS: Final = ("to_q", "to_k", "to_v", "to_out.0", "ffn.net.0.proj", "ffn.net.2")


class Run:
    """A model in training.

    Parameters
    ----------
    settings
        Of the training.
    accelerator
        Which has the devices.

    Attributes
    ----------
    plain
        The transformer with its adapter, not wrapped.
    optimiser
        Of the weights of the adapter alone.
    """

    def __init__(self, settings: TrainingSettings, accelerator: Accelerator) -> None:
        self._settings = settings
        self._accelerator = accelerator
        device = accelerator.device
        self._dtype = dtype_named(settings.dtype, device)
        folder = folder_of(settings.checkpoint, settings.revision)
        self._pipe = load_pipeline(
            folder, "", settings.dtype, str(device), settings.shift
        )
        self._texts = Texts(folder, self._dtype, settings.text_device or str(device))
        self.plain = self._pipe.transformer
        for part in (self._pipe.vae, self.plain):
            part.requires_grad_(requires_grad=False)
        torch.manual_seed(settings.seed)  # of the weights that the adapter starts with
        # A scale of 1, as the file of weights keeps none.
        adapter = LoraConfig(
            r=settings.rank, lora_alpha=settings.rank, target_modules=list(TARGETS)
        )
        self.plain.add_adapter(adapter, adapter_name=ADAPTER)
        if settings.checkpointing:
            self.plain.enable_gradient_checkpointing()
        self._weights = [one for one in self.plain.parameters() if one.requires_grad]
        for one in self._weights:  # small steps vanish in bfloat16
            one.data = one.data.float()
        self._model, self.optimiser = accelerator.prepare(
            self.plain,
            torch.optim.AdamW(
                self._weights,
                lr=settings.learning_rate,
                weight_decay=settings.weight_decay,
            ),
        )
        self.plain.train()

    def step(self, windows: Iterator[Window], done: int) -> float:
        """Take a step, given how many were taken; returns its mean loss."""
        settings, accelerator = self._settings, self._accelerator
        share = min(1.0, (done + 1) / max(settings.warmup, 1))
        for group in self.optimiser.param_groups:
            group["lr"] = settings.learning_rate * share
        total: Any = 0.0
        for _ in range(settings.batch):
            with accelerator.accumulate(self._model):
                window = next(windows)
                loss = continuation_loss(
                    self._pipe,
                    self._model,
                    window,
                    self._texts.embedded(window.text),
                    settings.shift,
                    self._dtype,
                )
                accelerator.backward(loss)
                if accelerator.sync_gradients:
                    accelerator.clip_grad_norm_(self._weights, settings.clip_norm)
                self.optimiser.step()
                self.optimiser.zero_grad()
            total = total + accelerator.reduce(loss.detach(), "mean")
        return float(total) / settings.batch
