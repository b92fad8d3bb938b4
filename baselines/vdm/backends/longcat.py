"""LongCat-Video, by the code of its authors, in an environment that they describe.

The code is no package: a folder of it is named. The model needs a GPU and the
attention kernels that its authors list. **This adapter has not been run with the real
weights**; it makes the calls of the authors' `run_demo_video_continuation.py`.
"""

import importlib
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import torch
from PIL import Image

from mpmworlds.baselines.learned.devices import check_fits, device_named
from mpmworlds.baselines.vdm.backends.protocol import Options
from mpmworlds.baselines.vdm.backends.wan_pipeline import dtype_named
from mpmworlds.baselines.vdm.memory import Clip
from mpmworlds.baselines.vdm.weights import digest_of, lora_file
from mpmworlds.metrics.reduction import Frames

CHUNK: Final = 93
OVERLAP: Final = 13
MULTIPLE: Final = 1  # it resizes frames itself
PACKAGE: Final = "longcat_video"
PIPELINE: Final = f"{PACKAGE}.pipeline_longcat_video"
RESOLUTION: Final = "480p"
PARTS: Final = {  # subfolder of the weights -> module and class that load it
    "vae": (f"{PACKAGE}.modules.autoencoder_kl_wan", "AutoencoderKLWan"),
    "scheduler": (
        f"{PACKAGE}.modules.scheduling_flow_match_euler_discrete",
        "FlowMatchEulerDiscreteScheduler",
    ),
    "dit": (f"{PACKAGE}.modules.longcat_video_dit", "LongCatVideoTransformer3DModel"),
    "tokenizer": ("transformers", "AutoTokenizer"),
    "text_encoder": ("transformers", "UMT5EncoderModel"),
}


def checked(options: Options, clip: Clip) -> Mapping[str, Any]:
    """Raise unless code and weights are there.

    Raises
    ------
    FileNotFoundError
        If one of them is not.
    RuntimeError
        If there is no GPU, or a smaller one than the transformer alone needs.
    """
    device = device_named(options.device)
    if options.device == "auto" and device.type == "cpu":
        raise RuntimeError(
            "backend longcat: needs a GPU, for which its attention is written; torch "
            "sees none"
        )
    code, weights = Path(options.checkout), Path(options.checkpoint)
    if not options.checkout or not (code / PACKAGE).is_dir():
        raise FileNotFoundError(
            f"checkout {options.checkout!r}: has no folder {PACKAGE}; name a clone of "
            "the code of LongCat-Video"
        )
    missing = [part for part in PARTS if not (weights / part).is_dir()]
    if not options.checkpoint or missing:
        raise FileNotFoundError(
            f"checkpoint {options.checkpoint!r}: has no folder "
            f"{', '.join(missing or PARTS)}; name the downloaded weights of "
            "LongCat-Video"
        )
    files = (weights / "dit").rglob("*.safetensors")
    needed = sum(file.stat().st_size for file in files)
    check_fits(f"vdm {options.checkpoint}", needed, device, "take a larger GPU")
    told: dict[str, Any] = {
        "dtype": str(_dtype(options)),
        "checkpoint": "",  # a folder may be moved
        "checkpoint_sha256": digest_of(weights / "dit"),
        "checkout": "",
        "code_sha256": digest_of(code / PACKAGE),
    }
    if options.lora:
        told |= {"lora": "", "lora_sha256": digest_of(lora_file(options.lora))}
    return told


def _dtype(options: Options) -> torch.dtype:
    """Its attention is made for bfloat16, on any device."""
    if options.dtype == "auto":
        return torch.bfloat16
    return dtype_named(options.dtype, device_named(options.device))


def open_backend(options: Options) -> "LongCat":
    """Load the model as the demonstration of its authors does."""
    device = device_named(options.device)
    dtype = _dtype(options)
    with _importable(Path(options.checkout)):
        split = importlib.import_module(
            f"{PACKAGE}.context_parallel.context_parallel_util"
        )
        parts = {}
        for part, (module, name) in PARTS.items():
            kind = getattr(importlib.import_module(module), name)
            more = {}
            if part == "dit":
                more["cp_split_hw"] = split.get_optimal_split(split.get_cp_size())
            parts[part] = kind.from_pretrained(
                options.checkpoint, subfolder=part, torch_dtype=dtype, **more
            )
        made_by = importlib.import_module(PIPELINE).LongCatVideoPipeline
    pipe = made_by(**parts)
    pipe.to(device)
    if options.lora:
        pipe.dit.load_lora(str(lora_file(options.lora)), "mpmworlds")
        pipe.dit.enable_loras(["mpmworlds"])
    return LongCat(pipe, device, options.steps, options.guidance)


@contextmanager
def _importable(code: Path) -> Iterator[None]:
    """Python finds the code while it is imported, and never before what it has."""
    sys.path.append(str(code))
    try:
        yield
    finally:
        sys.path.remove(str(code))


class LongCat:
    """A pipeline of LongCat-Video.

    Parameters
    ----------
    pipe
        The pipeline, on its device.
    device
        Where noise is drawn: its code draws it where the model is.
    steps, guidance
        As of `Options`.
    """

    name = "longcat"

    def __init__(
        self, pipe: Any, device: torch.device, steps: int, guidance: float
    ) -> None:
        self._pipe = pipe
        self._device = device
        self._steps = steps
        self._guidance = guidance

    def count_tokens(self, text: str) -> int:
        """Number of tokens of a text, its end among them."""
        return len(self._pipe.tokenizer(text).input_ids)

    def extend(self, given: Frames, text: str, new: int, seed: int) -> Frames:
        """Make the frames that follow; see `Backend`."""
        made = self._pipe.generate_vc(
            video=[Image.fromarray(frame) for frame in given],
            prompt=text,
            negative_prompt="",
            resolution=RESOLUTION,
            num_frames=len(given) + new,
            num_cond_frames=len(given),
            num_inference_steps=self._steps,
            guidance_scale=self._guidance,
            generator=torch.Generator(self._device).manual_seed(seed),
            use_kv_cache=True,
        )[0]
        size = given.shape[2], given.shape[1]
        levels = (np.asarray(made)[len(given) :] * 255).round().clip(0, 255)
        frames = [
            cv2.resize(frame, size, interpolation=cv2.INTER_AREA)
            for frame in levels.astype(np.uint8)
        ]
        return np.stack(frames)
