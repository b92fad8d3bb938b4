"""Wan2.1-VACE of diffusers: continuation as a video whose later part is masked."""

from collections.abc import Mapping
from typing import Any, Final

import torch

from mpmworlds.baselines.learned.devices import check_fits, device_named
from mpmworlds.baselines.vdm.backends.protocol import Options
from mpmworlds.baselines.vdm.backends.wan_pipeline import (
    Pipeline,
    as_frames,
    configs_of,
    dtype_named,
    folder_of,
    load_pipeline,
    masked,
    parameters_of,
)
from mpmworlds.baselines.vdm.backends.wan_text import Texts
from mpmworlds.baselines.vdm.memory import (
    PATCH,
    SPACE,
    Clip,
    inference_bytes,
    on_device,
)
from mpmworlds.baselines.vdm.weights import check_checkpoint, told_apart
from mpmworlds.metrics.reduction import Frames

CHECKPOINT: Final = "Wan-AI/Wan2.1-VACE-1.3B-diffusers"
CHUNK: Final = 81  # frames that the model was trained on
MULTIPLE: Final = SPACE * PATCH
# The whole prefix but its first frame. The pipeline brings the mask to latents by the
# nearest frame: where less than about a third is given, it calls the last latent new.
OVERLAP: Final = 37
SMALLER: Final = (
    "take a smaller checkpoint, size or chunk, dtype bfloat16, or text_device cpu"
)


def checked(options: Options, clip: Clip) -> Mapping[str, Any]:
    """Raise what can be raised before weights are read; say which they are.

    Raises
    ------
    FileNotFoundError
        If there is no such checkpoint or LoRA.
    RuntimeError, ValueError
        If there is no such device or type of floats, or it is another pipeline.
    TooLittleMemoryError
        If the model does not fit on the device.
    """
    device = device_named(options.device)
    device_named(options.text_device or options.device)
    kind = dtype_named(options.dtype, device)
    checkpoint = options.checkpoint or CHECKPOINT
    check_checkpoint(checkpoint)
    told = told_apart(checkpoint, options.revision, options.lora)
    configs = configs_of(checkpoint, options.revision)
    needed = inference_bytes(
        on_device(parameters_of(configs), options.text_device),
        configs["transformer"],
        configs["vae"],
        clip,
        kind.itemsize,
    )
    check_fits(f"vdm {checkpoint}", needed, device, SMALLER)
    return {**told, "dtype": str(kind)}


def open_backend(options: Options) -> "WanVace":
    """Load the model; see `wan_pipeline.load_pipeline`."""
    folder = folder_of(options.checkpoint or CHECKPOINT, options.revision)
    pipe = load_pipeline(
        folder, options.lora, options.dtype, options.device, options.shift
    )
    kind = dtype_named(options.dtype, pipe.device)
    texts = Texts(folder, kind, options.text_device or options.device)
    return WanVace(pipe, texts, options.steps, options.guidance)


class WanVace:
    """A pipeline of Wan2.1-VACE.

    Parameters
    ----------
    pipe
        The pipeline, on its device.
    texts
        Its text encoder.
    steps, guidance
        As of `Options`.
    """

    name = "wan_vace"

    def __init__(
        self, pipe: Pipeline, texts: Texts, steps: int, guidance: float
    ) -> None:
        self._pipe = pipe
        self._texts = texts
        self._steps = steps
        self._guidance = guidance

    def count_tokens(self, text: str) -> int:
        """Number of tokens of a text, its end among them."""
        return self._texts.count(text)

    def extend(self, given: Frames, text: str, new: int, seed: int) -> Frames:
        """Make the frames that follow; see `Backend`.

        The noise is drawn on the processor, so it is the same on every device.
        """
        video, mask = masked(given, new)
        height, width = given.shape[1:3]
        # It takes (T, C, H, W) from 0 to 1, and scales them itself.
        made = self._pipe(
            video=[(video[0].transpose(0, 1) + 1) / 2],
            mask=[mask[0].transpose(0, 1)],
            prompt_embeds=self._texts.embedded(text).to(self._pipe.device),
            negative_prompt_embeds=self._texts.embedded("").to(self._pipe.device),
            height=height,
            width=width,
            num_frames=len(given) + new,
            num_inference_steps=self._steps,
            guidance_scale=self._guidance,
            generator=torch.Generator().manual_seed(seed),
            output_type="pt",
        ).frames
        # (1, T, C, H, W) from 0 to 1. The given frames come back changed by the codec
        # of the model; those that are known are better, so these are dropped.
        return as_frames(made[:, len(given) :].transpose(1, 2) * 2 - 1)
