"""Steps of a training, and what is looked at on the way."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import torch
from accelerate import Accelerator
from torch.utils.data import DataLoader
from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.baselines.learned.devices import device_named
from mpmworlds.baselines.learned.notes import Note
from mpmworlds.baselines.small.checkpoint import FAMILY, VERSION, save_network
from mpmworlds.baselines.small.learning.losses import unrolled
from mpmworlds.baselines.small.learning.progress import Progress
from mpmworlds.baselines.small.learning.windows import LabelFiles, Window, Windows
from mpmworlds.baselines.small.network import LabelUNet, Shape
from mpmworlds.baselines.small.rollout import padded
from mpmworlds.baselines.small.settings import TrainingSettings
from mpmworlds.loaders.export.folder import Source
from mpmworlds.loaders.regimes import regime_named
from mpmworlds.loaders.weights import sampling_weights

_APART: Final = 2**32  # first number of the windows that are held out


def train_network(
    source: Source, settings: TrainingSettings, out_dir: Path, *, progress: bool
) -> Path:
    """Train a label model, or go on with it; see `learned.families.Training`.

    Raises
    ------
    ValueError
        If the folder holds another training, the release has no such samples, or their
        videos are too short.
    """
    made_of = source.noted()
    on_cpu = device_named(settings.device).type == "cpu"
    accelerator = Accelerator(cpu=on_cpu, mixed_precision=settings.precision)
    log = Progress(out_dir, settings, made_of, main=accelerator.is_main_process)
    loop = _Loop(accelerator, settings, source, out_dir)
    done = log.resumed(accelerator, loop.ema)
    bar = tqdm(
        total=settings.steps,
        initial=done,
        desc="train small",
        unit="step",
        disable=not (progress and accelerator.is_main_process),
    )
    with bar:
        for step, told in loop.steps_from(done):
            bar.set_postfix(told, refresh=False)
            bar.update()
            last = step == settings.steps
            if step % settings.save_every == 0 or last:
                told |= loop.held_out()
                log.save(accelerator, step)
            if step % settings.log_every == 0 or step % settings.save_every == 0:
                log.note(step, told)
    if accelerator.is_main_process:
        note = Note(
            FAMILY, VERSION, settings.model_dump(mode="json"), made_of, settings.steps
        )
        save_network(loop.network, loop.ema.weights, out_dir, note)
    accelerator.wait_for_everyone()
    return out_dir


class Batch(NamedTuple):
    """Windows, stacked."""

    labels: torch.Tensor
    """uint8 (B, frames, N, N)."""
    fields: torch.Tensor
    """float32 (B, CLASSES, FEATURES)."""


class Ema:
    """The mean of weights over the steps so far, younger ones counting more."""

    def __init__(self, network: LabelUNet, decay: float) -> None:
        self._decay = decay
        self.weights = {k: v.detach().clone() for k, v in network.state_dict().items()}

    def update(self, network: LabelUNet, step: int) -> None:
        """Take in the weights after a step; the first steps count as they are."""
        share = 1.0 - min(self._decay, step / (step + 10.0))
        for name, value in network.state_dict().items():
            self.weights[name].lerp_(value.detach(), share)

    def state_dict(self) -> dict[str, Any]:
        """For a checkpoint."""
        return self.weights

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """From a checkpoint."""
        for name, value in state.items():
            self.weights[name].copy_(value)


class _Loop:
    """Steps of the optimiser."""

    def __init__(
        self,
        accelerator: Accelerator,
        settings: TrainingSettings,
        source: Source,
        out_dir: Path,
    ) -> None:
        self._accelerator, self._settings = accelerator, settings
        regime = regime_named(source.regime)
        shape = Shape.of(settings, told=not regime.blind)
        with torch.random.fork_rng():
            torch.manual_seed(settings.seed)
            self.network = LabelUNet(shape).to(accelerator.device)
        torch.backends.cudnn.deterministic = True  # the same weights from the same seed
        self.ema = Ema(self.network, settings.ema)
        optimizer = torch.optim.AdamW(
            self.network.parameters(), weight_decay=settings.weight_decay
        )
        self._wrapped, self._optimizer = accelerator.prepare(self.network, optimizer)
        examples = source.load()
        self._files = LabelFiles(examples, out_dir / "labels")
        self._weights = sampling_weights(examples.table["kind"])
        self._flips = regime.blind
        names = sorted(range(len(examples)), key=lambda k: str(examples.table["id"][k]))
        apart = min(settings.held_out, len(names) // 2)
        gap = len(names) // apart if apart else 0
        self._apart = names[::gap][:apart] if apart else []
        self._chosen = sorted(set(names) - set(self._apart))

    def steps_from(self, done: int) -> Iterator[tuple[int, dict[str, float]]]:
        """Take the steps that are left; tells how each went."""
        settings = self._settings
        begin = int(settings.unroll_from * settings.steps)
        for first, last, unroll in (
            (done, min(begin, settings.steps), 1),
            (max(done, begin), settings.steps, settings.unroll),
        ):
            batches = self._batches(first, last, unroll)
            for step, batch in enumerate(batches, first + 1):
                yield step, self._step(step, batch)

    def _step(self, step: int, batch: Batch) -> dict[str, float]:
        rate = self._rate(step)
        for group in self._optimizer.param_groups:
            group["lr"] = rate
        self._optimizer.zero_grad()
        labels, fields = self._tensors(batch)
        settings = self._settings
        horizons = (labels.shape[1] - settings.context) // settings.horizon
        total, moved, right = 0.0, 0, 0
        with self._accelerator.autocast():
            losses = unrolled(
                self._wrapped, labels, fields, settings.context, settings.changed_weight
            )
            for loss, changed, hit in losses:
                self._accelerator.backward(loss / horizons)
                total += float(loss.detach()) / horizons
                moved, right = moved + int(changed), right + int(hit)
        self._accelerator.clip_grad_norm_(self._wrapped.parameters(), 1.0)
        self._optimizer.step()
        self.ema.update(self.network, step)
        return {"loss": total, "moved": right / max(moved, 1), "rate": rate}

    @torch.no_grad()
    def held_out(self) -> dict[str, float]:
        """Loss, and share of changed pixels that are right, on what is held out."""
        if not self._apart:
            return {}
        settings = self._settings
        windows = self._windows(self._apart, settings.unroll)
        kept = {k: v.clone() for k, v in self.network.state_dict().items()}
        self.network.load_state_dict(self.ema.weights)
        total, count, moved, right = 0.0, 0, 0, 0
        for number in range(2 * len(self._apart)):
            labels, fields = self._tensors(_stacked([windows[_APART + number]]))
            with self._accelerator.autocast():
                losses = unrolled(
                    self.network,
                    labels,
                    fields,
                    settings.context,
                    settings.changed_weight,
                )
                for loss, changed, hit in losses:
                    total, count = total + float(loss), count + 1
                    moved, right = moved + int(changed), right + int(hit)
        self.network.load_state_dict(kept)
        return {"held_out_loss": total / count, "held_out_moved": right / max(moved, 1)}

    def _rate(self, step: int) -> float:
        settings = self._settings
        up = min(1.0, step / max(settings.warmup, 1))
        down = 0.5 + 0.5 * math.cos(math.pi * (step - 1) / settings.steps)
        return settings.learning_rate * up * down

    def _tensors(self, batch: Batch) -> tuple[torch.Tensor, torch.Tensor | None]:
        device = self._accelerator.device
        labels = padded(batch.labels.to(device).long(), self.network)
        told = self.network.shape.told
        return labels, batch.fields.to(device) if told else None

    def _windows(self, chosen: list[int], unroll: int) -> Windows:
        settings = self._settings
        return Windows(
            self._files,
            chosen,
            [self._weights[k] for k in chosen],
            settings.context + unroll * settings.horizon,
            settings.seed,
            flips=self._flips,
        )

    def _batches(self, first: int, last: int, unroll: int) -> Any:
        """Batches of the steps after `first` up to `last`, of this process."""
        batch, world = self._settings.batch, self._accelerator.num_processes
        rank = self._accelerator.process_index
        numbers = [
            [(step * world + rank) * batch + k for k in range(batch)]
            for step in range(first, last)
        ]
        return DataLoader(
            self._windows(self._chosen, unroll),
            batch_sampler=numbers,
            num_workers=self._settings.workers,
            collate_fn=_stacked,
        )


def _stacked(windows: list[Window]) -> Batch:
    """A batch of windows."""
    labels, fields = zip(*windows, strict=True)
    return Batch(torch.from_numpy(np.stack(labels)), torch.from_numpy(np.stack(fields)))
