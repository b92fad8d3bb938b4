"""The encoder of videos of Wan alone, there and back."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import torch
from diffusers import AutoencoderKLWan
from huggingface_hub import snapshot_download

from mpmworlds.baselines.learned.devices import device_named
from mpmworlds.baselines.vdm.backends.wan_pipeline import as_frames, as_video
from mpmworlds.baselines.vdm.backends.wan_vace import CHECKPOINT
from mpmworlds.baselines.vdm.memory import SPACE
from mpmworlds.baselines.vdm.weights import (
    check_checkpoint,
    commit_of,
    digest_of,
    is_folder,
)
from mpmworlds.metrics.reduction import Frames

MULTIPLE: Final = SPACE
_VAE: Final[Any] = AutoencoderKLWan  # its methods have no types
PART: Final = "vae"


def told_of(checkpoint: str, revision: str, device: str) -> dict[str, Any]:
    """What tells the encoder apart; raises if it or the device is not there."""
    device_named(device)
    place = checkpoint or CHECKPOINT
    check_checkpoint(place)
    if is_folder(place):
        return {"checkpoint": "", "vae_sha256": digest_of(Path(place) / PART)}
    return {"checkpoint": place, "revision": commit_of(place, revision)}


def open_round_trip(
    checkpoint: str, revision: str, device: str
) -> Callable[[Frames], Frames]:
    """Load the encoder, as float32, and return what sends frames through it."""
    place = checkpoint or CHECKPOINT
    if not is_folder(place):
        place = snapshot_download(
            place, revision=revision or None, allow_patterns=f"{PART}/*"
        )
    vae = _VAE.from_pretrained(place, subfolder=PART, dtype=torch.float32)
    return partial(round_trip, vae.to(device_named(device)).eval())


@torch.no_grad()
def round_trip(vae: Any, frames: Frames) -> Frames:
    """Frames, 4 k + 1 of them, as they come back."""
    video = as_video(frames).to(vae.device)
    return as_frames(vae.decode(vae.encode(video).latent_dist.mode()).sample)
