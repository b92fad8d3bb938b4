"""A finetuning as it is carried out by one process, of one or of several."""

import json
import logging
import math
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import torch
from transformers import AutoModelForImageTextToText, TrainingArguments

from mpmworlds.baselines.learned.devices import check_fits
from mpmworlds.baselines.learned.notes import Note, write_note
from mpmworlds.baselines.vlm.encoding import Encoder
from mpmworlds.baselines.vlm.learning.examples import (
    Asking,
    Chats,
    Collator,
    lengths,
    order_of,
)
from mpmworlds.baselines.vlm.learning.loss import chunk_loss
from mpmworlds.baselines.vlm.learning.trainer import ResumingTrainer, quiet
from mpmworlds.baselines.vlm.memory import Shape, training_bytes
from mpmworlds.baselines.vlm.places import Place
from mpmworlds.baselines.vlm.settings import (
    CHECKPOINTS,
    LOG,
    STATE,
    TrainingSettings,
)
from mpmworlds.baselines.vlm.writer import read_config
from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.load import Examples

log = logging.getLogger(__name__)
SHARDED: Final = "ACCELERATE_USE_FSDP"  # set by `accelerate launch`
SHARDED_CHECKPOINTS: Final = "FSDP_ACTIVATION_CHECKPOINTING"  # likewise


class Run:
    """A finetuning.

    Parameters
    ----------
    examples
        Samples to train on, before long ones are left out.
    settings
        How it is done.
    place
        The model to begin with.
    out_dir
        Folder of the training.
    note
        What it is; steps and what was left out are still to be told.
    """

    def __init__(
        self,
        examples: Examples,
        settings: TrainingSettings,
        place: Place,
        out_dir: Path,
        note: Note,
    ) -> None:
        self._settings, self._place = settings, place
        self._out, self._note = out_dir, note
        self._encoder = Encoder(place.folder)
        self._arguments = self._made_arguments()
        self._check_memory()
        asking = Asking(settings.task, settings.pictures)
        self._examples, self._left_out = self._short_enough(examples, asking)
        self._steps = math.ceil(len(self._examples) * settings.epochs / settings.batch)
        self._arguments.max_steps = self._steps
        order = order_of(
            list(self._examples.table["kind"]),
            self._steps * settings.batch,
            settings.seed,
            weighted=settings.weighted,
        )
        self._chats = Chats(self._examples, order, self._encoder, asking)

    def carry_out(self, *, progress: bool) -> None:
        """Train from the last checkpoint, if there is one, and write the model."""
        first = self._arguments.process_index == 0
        if first:
            write_note(self._out / CHECKPOINTS, self._note)
        trainer = ResumingTrainer(
            model=self._model(),
            args=self._arguments,
            train_dataset=self._chats,
            data_collator=Collator(
                self._encoder.tokenizer.pad_token_id, self._encoder.pad
            ),
        )
        quiet(trainer, progress=progress)
        found = last_checkpoint(self._out / CHECKPOINTS)
        trainer.train(resume_from_checkpoint=None if found is None else str(found))
        weights = trainer.accelerator.get_state_dict(trainer.model)
        if first:
            self._write(trainer, weights)
        trainer.accelerator.wait_for_everyone()

    def _made_arguments(self) -> TrainingArguments:
        settings = self._settings
        arguments = TrainingArguments(
            output_dir=str(self._out / CHECKPOINTS),
            per_device_train_batch_size=settings.per_device,
            learning_rate=settings.learning_rate,
            lr_scheduler_type="cosine",
            warmup_steps=settings.warmup,  # below 1 it is a share
            weight_decay=settings.weight_decay,
            max_grad_norm=settings.max_grad_norm,
            bf16=settings.half,
            use_cpu=not torch.cuda.is_available(),
            # Sharded, accelerate has its own: the other one gathers weights twice.
            activation_checkpointing=settings.checkpointing
            and os.environ.get(SHARDED_CHECKPOINTS, "false").lower() != "true",
            save_steps=settings.save_steps,
            save_total_limit=settings.keep,
            logging_steps=1,
            seed=settings.seed,
            data_seed=settings.seed,
            train_sampling_strategy="sequential",  # `order_of` has drawn already
            dataloader_num_workers=settings.workers,
            dataloader_pin_memory=torch.cuda.is_available(),
            remove_unused_columns=False,
            report_to="none",
            disable_tqdm=True,
        )
        at_once = settings.per_device * arguments.world_size
        if settings.batch % at_once:
            raise ValueError(
                f"batch = {settings.batch}, must be a multiple of {at_once}: "
                f"per_device = {settings.per_device} on {arguments.world_size} devices"
            )
        arguments.gradient_accumulation_steps = settings.batch // at_once
        return arguments

    def _check_memory(self) -> None:
        settings, world = self._settings, self._arguments.world_size
        shape = Shape.of(read_config(self._place.folder))
        sharded = os.environ.get(SHARDED, "false").lower() == "true"
        tokens = settings.per_device * settings.max_tokens
        needed = training_bytes(
            shape, world if sharded else 1, tokens, half=settings.half
        )
        check_fits(
            f"full finetuning of {shape.parameters / 1e9:.1f} billion parameters",
            needed,
            self._arguments.device,
            "launch it over more GPUs by `accelerate launch --config_file` with a file "
            "of baselines/vlm/launch, lower max_tokens, or finetune a smaller model of "
            "the family",
        )

    def _short_enough(self, examples: Examples, asking: Asking) -> tuple[Examples, int]:
        """Samples that are trained on, and the number of those that are too long."""
        most = self._settings.max_tokens
        sizes = list(lengths(examples, self._encoder, asking))
        kept = [number for number, size in enumerate(sizes) if size <= most]
        left_out = len(sizes) - len(kept)
        if not kept:
            raise ValueError(
                f"max_tokens = {most}: every sample is longer, the shortest has "
                f"{min(sizes)} tokens; raise it"
            )
        if left_out:
            log.warning(
                "%d of %d samples are left out: more than %d tokens, at most %d; raise "
                "max_tokens to train on them",
                left_out,
                len(sizes),
                most,
                max(sizes),
            )
        table = examples.table.select(kept)
        return Examples(table, examples.regime.name, examples.of), left_out

    def _model(self) -> Any:
        """The model, its weights in full precision: what is learned is small."""
        model = AutoModelForImageTextToText.from_pretrained(
            self._place.folder, dtype=torch.float32
        )
        chunk_loss(model)
        return model

    def _write(self, trainer: ResumingTrainer, weights: Mapping[str, Any]) -> None:
        """Write what `from_pretrained` reads; last the note, which says it is whole."""
        model: Any = trainer.accelerator.unwrap_model(trainer.model)
        if self._settings.half:
            weights = {name: one.to(torch.bfloat16) for name, one in weights.items()}
        model.save_pretrained(self._out, state_dict=weights)
        if self._settings.half:  # it notes what the model has, not what is written
            model.config.dtype = torch.bfloat16
            model.config.save_pretrained(self._out)
        self._encoder.tokenizer.save_pretrained(self._out)
        self._encoder.processor.save_pretrained(self._out)
        told = json.dumps(trainer.state.log_history, indent=1) + "\n"
        write_atomically(self._out / LOG, told.encode())
        made_of = self._note.made_of | {
            "samples": len(self._examples),
            "left_out": self._left_out,
        }
        write_note(self._out, replace(self._note, made_of=made_of, steps=self._steps))


def last_checkpoint(folder: Path) -> Path | None:
    """The last checkpoint that was written whole."""
    found = [path for path in folder.glob("checkpoint-*") if _is_whole(path)]
    return max(found, key=_step, default=None)


def _step(checkpoint: Path) -> int:
    return int(checkpoint.name.rpartition("-")[2])


def _is_whole(checkpoint: Path) -> bool:
    """Whether the last file of it can be read."""
    try:
        return isinstance(json.loads((checkpoint / STATE).read_bytes()), dict)
    except (OSError, ValueError):
        return False
