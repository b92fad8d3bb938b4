"""The loop of the training, on one device or several."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from accelerate import Accelerator
from torch.utils.data import DataLoader
from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.baselines.learned.devices import check_fits, device_named
from mpmworlds.baselines.learned.losses import forget_after
from mpmworlds.baselines.learned.notes import NOTE, Note
from mpmworlds.baselines.vdm.backends.wan_pipeline import (
    configs_of,
    dtype_named,
    parameters_of,
)
from mpmworlds.baselines.vdm.lora.checkpoints import (
    newest,
    publish,
    restore,
    save,
    steps_done,
)
from mpmworlds.baselines.vdm.lora.run import Run
from mpmworlds.baselines.vdm.lora.windows import Window, Windows
from mpmworlds.baselines.vdm.memory import Clip, on_device, training_bytes
from mpmworlds.baselines.vdm.settings import TrainingSettings
from mpmworlds.baselines.vdm.text import TEXT_VERSION
from mpmworlds.baselines.vdm.weights import (
    FAMILY,
    VERSION,
    check_checkpoint,
    told_apart,
)
from mpmworlds.files.journal import append_records
from mpmworlds.files.targets import check_folder
from mpmworlds.loaders.export.folder import Source
from mpmworlds.metrics.reduction import SIDE

LOSSES: Final = "losses.jsonl"


def train_lora(
    source: Source, settings: TrainingSettings, out_dir: Path, *, progress: bool
) -> Path:
    """Train, or go on; see `training.train`.

    Several processes, as `accelerate launch` starts them, share the windows: a step
    then has `batch` windows of each.
    """
    check_folder(out_dir)
    told = settings.model_dump(mode="json")
    accelerator = Accelerator(
        cpu=settings.device == "cpu", gradient_accumulation_steps=settings.batch
    )
    made_of = checked(source, settings) | {"processes": accelerator.num_processes}
    if (out_dir / NOTE).is_file():
        if steps_done(out_dir, told, made_of) >= settings.steps:
            return out_dir
    last = newest(out_dir)
    done = 0 if last is None else steps_done(last, told, made_of)
    run = Run(settings, accelerator)
    if last is not None:
        restore(last, run.plain, run.optimiser)
    if accelerator.is_main_process:
        forget_after(out_dir / LOSSES, done)
    windows = _windows(source, settings, accelerator, done)
    bar = tqdm(
        total=settings.steps,
        initial=done,
        unit="step",
        disable=not (progress and accelerator.is_main_process),
    )
    while done < settings.steps:
        loss = run.step(windows, done)
        done += 1
        bar.update()
        if not accelerator.is_main_process:
            continue
        append_records(out_dir / LOSSES, [{"step": done, "loss": loss}])
        if done % settings.save_every == 0 or done == settings.steps:
            note = Note(FAMILY, VERSION, told, made_of, done)
            last = save(out_dir, run.plain, run.optimiser, note)
    accelerator.wait_for_everyone()
    if accelerator.is_main_process and last is not None:
        publish(last, out_dir)
    return out_dir


def checked(source: Source, settings: TrainingSettings) -> dict[str, Any]:
    """Raise what can be raised before weights are read; say what is trained on what."""
    device = device_named(settings.device)
    kind = dtype_named(settings.dtype, device)
    check_checkpoint(settings.checkpoint)
    weights = told_apart(settings.checkpoint, settings.revision, "")
    configs = configs_of(settings.checkpoint, settings.revision)
    size = settings.size or SIDE
    needed = training_bytes(
        on_device(parameters_of(configs), settings.text_device),
        configs["transformer"],
        configs["vae"],
        Clip(settings.chunk, size, size),
        settings.rank,
        checkpointing=settings.checkpointing,
        bytes_each=kind.itemsize,
    )
    remedy = (
        "take checkpointing true, text_device cpu, or a smaller checkpoint or chunk"
    )
    check_fits(f"training of {settings.checkpoint}", needed, device, remedy)
    return {**source.noted(), "text": TEXT_VERSION, **weights}


def _windows(
    source: Source, settings: TrainingSettings, accelerator: Accelerator, done: int
) -> Iterator[Window]:
    """What this process sees from a step on."""
    processes = accelerator.num_processes
    windows = Windows(
        source,
        settings,
        done * settings.batch * processes + accelerator.process_index,
        processes,
        (settings.steps - done) * settings.batch,
    )
    loader: Any = DataLoader(
        windows,  # type: ignore[arg-type]
        batch_size=None,
        num_workers=settings.workers,
        collate_fn=_as_it_is,
    )
    return iter(loader)


def _as_it_is(window: Any) -> Any:
    return window
