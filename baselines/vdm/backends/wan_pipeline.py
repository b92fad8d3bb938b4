"""A WanVACE pipeline, loaded with its LoRA, and the tensors that go through it.

Training and prediction make their tensors here, so that both see the same.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import torch
from diffusers import AutoencoderKLWan, WanVACEPipeline, WanVACETransformer3DModel
from huggingface_hub import hf_hub_download
from transformers import UMT5Config, UMT5EncoderModel

from mpmworlds.baselines.learned.devices import device_named
from mpmworlds.baselines.vdm.weights import INDEX, is_folder, lora_file
from mpmworlds.metrics.reduction import Frames

Tensor = torch.Tensor
Pipeline: TypeAlias = Any  # a WanVACEPipeline, whose parts have no types
_WAN: Final[Any] = WanVACEPipeline
_TRANSFORMER: Final[Any] = WanVACETransformer3DModel
_VAE: Final[Any] = AutoencoderKLWan
ADAPTER: Final = "mpmworlds"
PARTS: Final = ("text_encoder", "transformer", "vae")


def dtype_named(name: str, device: torch.device) -> torch.dtype:
    """A type of floats; `auto` is bfloat16 on a GPU, else float32.

    Raises
    ------
    ValueError
        If torch has none of that name.
    """
    if name == "auto":
        return torch.bfloat16 if device.type == "cuda" else torch.float32
    dtype = getattr(torch, name, None)
    if not isinstance(dtype, torch.dtype) or not dtype.is_floating_point:
        raise ValueError(
            f"dtype {name!r}: is no type of floats, must be auto, float32 or bfloat16"
        )
    return dtype


def folder_of(checkpoint: str, revision: str) -> Path:
    """Folder of a pipeline, downloaded if it is a repository on the Hub."""
    if is_folder(checkpoint):
        return Path(checkpoint)
    return Path(_WAN.download(checkpoint, revision=revision or None))


def configs_of(checkpoint: str, revision: str) -> dict[str, dict[str, Any]]:
    """Configuration of each part of a pipeline that has weights, without the weights.

    Raises
    ------
    ValueError
        If it is another kind of pipeline.
    """
    index = _json(checkpoint, revision, INDEX)
    found = index.get("_class_name")
    if found != WanVACEPipeline.__name__:
        raise ValueError(
            f"{checkpoint}: is a {found}, must be a {WanVACEPipeline.__name__}, such "
            "as Wan-AI/Wan2.1-VACE-1.3B-diffusers"
        )
    return {part: _json(checkpoint, revision, f"{part}/config.json") for part in PARTS}


def _json(checkpoint: str, revision: str, name: str) -> dict[str, Any]:
    path = Path(checkpoint) / name
    if not is_folder(checkpoint):
        path = Path(hf_hub_download(checkpoint, name, revision=revision or None))
    return dict(json.loads(path.read_text("utf-8")))


def parameters_of(configs: Mapping[str, Mapping[str, Any]]) -> dict[str, int]:
    """Number of parameters of each part, made without memory."""
    with torch.device("meta"):
        parts: dict[str, torch.nn.Module] = {
            "text_encoder": UMT5EncoderModel(UMT5Config(**configs["text_encoder"])),
            "transformer": _TRANSFORMER.from_config(configs["transformer"]),
            "vae": _VAE.from_config(configs["vae"]),
        }
    return {
        name: sum(weight.numel() for weight in part.parameters())
        for name, part in parts.items()
    }


def load_pipeline(
    folder: Path, lora: str, dtype: str, device: str, shift: float
) -> Pipeline:
    """Load a pipeline without its text encoder, see `wan_text`, onto a device.

    Parameters
    ----------
    folder
        Of `folder_of`.
    lora
        File or folder of LoRA weights; none if empty.
    dtype, device
        Names. The encoder of videos is always float32: bfloat16 has 8 bits for the
        256 levels of a colour.
    shift
        Of the noise levels of the sampler.
    """
    place = device_named(device)
    kind = dtype_named(dtype, place)
    pipe = _WAN.from_pretrained(
        folder, text_encoder=None, dtype={"default": kind, "vae": torch.float32}
    )
    pipe.set_progress_bar_config(disable=True)
    pipe.scheduler = _shifted(pipe.scheduler, shift)
    if lora:
        file = lora_file(lora)
        pipe.load_lora_weights(file.parent, weight_name=file.name, adapter_name=ADAPTER)
    return pipe.to(place)


def _shifted(scheduler: Any, shift: float) -> Any:
    """Schedulers name the shift of their noise levels in two ways."""
    name = "flow_shift" if "flow_shift" in scheduler.config else "shift"
    return type(scheduler).from_config(scheduler.config, **{name: shift})


def as_video(frames: Frames) -> Tensor:
    """Frames uint8 (T, H, W, 3) as a video (1, 3, T, H, W) from -1 to 1."""
    video = torch.from_numpy(np.ascontiguousarray(frames)).permute(3, 0, 1, 2)
    return video[None].float() / 127.5 - 1


def as_frames(video: Tensor) -> Frames:
    """A video (1, 3, T, H, W) from -1 to 1 as frames uint8 (T, H, W, 3)."""
    levels = ((video[0].float() + 1) * 127.5).round().clamp(0, 255)
    return levels.to(torch.uint8).permute(1, 2, 3, 0).cpu().numpy()


@torch.no_grad()
def latents_of(pipe: Pipeline, frames: Frames) -> Tensor:
    """Latents (1, Z, 1 + (T - 1) / 4, H / 8, W / 8) of frames, each channel scaled."""
    vae = pipe.vae
    latents: Tensor = vae.encode(as_video(frames).to(vae.device)).latent_dist.mode()
    mean, deviation = (
        torch.tensor(of_channels, device=latents.device).view(1, -1, 1, 1, 1)
        for of_channels in (vae.config.latents_mean, vae.config.latents_std)
    )
    return (latents - mean) / deviation


@torch.no_grad()
def control_of(pipe: Pipeline, given: Frames, new: int) -> Tensor:
    """What the control branch sees: the frames that are given, and which are not.

    Returns
    -------
    Tensor
        (1, 2 Z + 64, 1 + (T - 1) / 4, H / 8, W / 8), as the pipeline makes it.
    """
    video, mask = masked(given, new)
    video, mask = video.to(pipe.vae.device), mask.to(pipe.vae.device)
    seen = pipe.prepare_video_latents(video, mask, [[]], None, video.device)
    return torch.cat([seen, pipe.prepare_masks(mask, [[]])], dim=1)


def masked(given: Frames, new: int) -> tuple[Tensor, Tensor]:
    """Given and grey frames, (1, 3, T, H, W), and a mask of them, 1 where grey."""
    known = as_video(given)
    video = torch.nn.functional.pad(known, (0, 0, 0, 0, 0, new))
    mask = torch.zeros_like(video)
    mask[:, :, known.shape[2] :] = 1
    return video, mask
