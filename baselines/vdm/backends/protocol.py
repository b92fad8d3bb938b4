"""What a video model is: frames, a text and a number in, that many more frames out."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final, Protocol

from mpmworlds.baselines.vdm.memory import Clip
from mpmworlds.metrics.reduction import Frames

BACKENDS: Final = ("wan_vace", "longcat")


class Backend(Protocol):
    """A video model that is loaded."""

    name: str
    """One of `BACKENDS`."""

    def count_tokens(self, text: str, /) -> int:
        """Number of tokens of a text, whatever the model reads of them."""
        ...

    def extend(self, given: Frames, text: str, new: int, seed: int, /) -> Frames:
        """Make the frames that follow.

        Parameters
        ----------
        given
            uint8 (4 j + 1, H, W, 3), RGB.
        text
            What is told; beyond 512 tokens it is not read.
        new
            Number of frames to make, a multiple of 4.
        seed
            Of all that is drawn.

        Returns
        -------
        ndarray
            uint8 (new, H, W, 3), without those that were given.
        """
        ...


@dataclass(frozen=True)
class Options:
    """With what a backend is opened."""

    checkpoint: str
    """Folder of weights, or id of a repository on the Hub; that of the backend if
    empty."""
    revision: str
    """Version of a repository on the Hub; its newest one if empty."""
    lora: str
    """Folder or file of LoRA weights; none if empty."""
    steps: int
    """Steps of the sampler."""
    guidance: float
    """Scale of classifier-free guidance; 1 is without. [1]"""
    shift: float
    """Shift of the noise levels of the sampler. [1]"""
    dtype: str
    """Of the weights, as torch names it; `auto`: bfloat16 on a GPU, else float32."""
    device: str
    """As `mpmworlds.baselines.learned.devices.device_named` has them."""
    text_device: str
    """Where texts are encoded, `cpu` to save memory; as `device` if empty."""
    checkout: str
    """Folder of the code of the model, for a backend whose code is no package."""


class BackendModule(Protocol):
    """A module of a backend."""

    CHUNK: int
    """Most frames of a call, given and new."""
    OVERLAP: int
    """Most frames that are given."""
    MULTIPLE: int
    """What the sides of its frames must be a multiple of. [px]"""

    def checked(self, options: Options, clip: Clip, /) -> Mapping[str, Any]:
        """Raise what can be raised before anything is loaded; say what will be.

        Parameters
        ----------
        options
            With what the backend will be opened.
        clip
            Form of a call, by which memory is estimated.

        Returns
        -------
        mapping
            What tells the weights apart, for the provenance of results.
        """
        ...

    def open_backend(self, options: Options, /) -> Backend:
        """Load the model."""
        ...


def backend_module(name: str) -> BackendModule:
    """The module of a backend.

    Raises
    ------
    ValueError
        If there is none of that name.
    """
    if name not in BACKENDS:
        raise ValueError(f"backend {name!r}: unknown, must be one of {list(BACKENDS)}")
    return import_module(f"mpmworlds.baselines.vdm.backends.{name}")
