"""The label model as a predictor: continues labels, and colours them."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mpmworlds.baselines.learned.devices import device_named
from mpmworlds.baselines.learned.extras import need
from mpmworlds.baselines.protocol import Candidate, Task
from mpmworlds.baselines.small.fields import fields_of
from mpmworlds.baselines.small.slots import UNKNOWN, Slots
from mpmworlds.loaders.regimes import REGIMES

if TYPE_CHECKING:
    from mpmworlds.baselines.learned.notes import Note
    from mpmworlds.baselines.small.network import LabelUNet


class SmallModel:
    """Continues a video by a trained label model; see `mpmworlds train small`.

    Parameters
    ----------
    checkpoint
        Folder of the trained model.
    device
        As torch names it; ``auto`` is the GPU if there is one.
    kept
        Part of its area that nothing falls below, see `rollout.held`; 0 for no bound.

    Raises
    ------
    MissingExtraError
        If torch or safetensors is not installed.
    """

    name = "small"
    packages = ("torch",)

    def __init__(
        self,
        checkpoint: str = "work/models/small",
        device: str = "auto",
        kept: float = 0.97,
    ) -> None:
        if not 0.0 <= kept <= 1.0:
            raise ValueError(f"kept = {kept}, must be from 0 to 1")
        self._kept = kept
        need("small", "torch", "safetensors")
        self._folder, self._device = Path(checkpoint), device_named(device)

    @property
    def exclusive(self) -> bool:
        """Whether it has a GPU for itself."""
        return bool(self._device.type != "cpu")

    @property
    def configuration(self) -> Mapping[str, Any]:
        """The weights count, not where they lie."""
        from mpmworlds.baselines.small.checkpoint import weights_sha256

        return {
            "checkpoint": "",
            "kept": self._kept,
            "weights_sha256": weights_sha256(self._folder),
            "trained_on": self._trained_on,
        }

    @property
    def regimes(self) -> Sequence[str]:
        """What it may be told: what it was told in training, or anything if nothing."""
        blind = REGIMES[self._trained_on].blind
        return list(REGIMES) if blind else [self._trained_on]

    def predict(self, task: Task) -> Sequence[Candidate]:
        """Return the continuation, and the prefix as it would have been continued."""
        from mpmworlds.baselines.small.rollout import continued

        network, _ = self._loaded
        slots = Slots.of(task.prefix)
        seen = slots.labels(task.prefix)
        seen[seen == UNKNOWN] = 0
        told = fields_of(task.side_info, slots) if network.shape.told else None
        context = network.shape.context
        with _one_thread(self._device):
            rest = continued(network, seen, task.horizon, told, self._kept)
            known = seen[:context]
            left = max(len(seen) - context, 0)
            own = continued(network, known, left, told, self._kept)
        return [
            Candidate(slots.frames(rest), slots.frames(np.concatenate([known, own])))
        ]

    @property
    def _trained_on(self) -> str:
        return str(self._loaded[1].made_of.get("regime", ""))

    @cached_property
    def _loaded(self) -> "tuple[LabelUNet, Note]":
        from mpmworlds.baselines.small.checkpoint import load_network

        return load_network(self._folder, self._device)


@contextmanager
def _one_thread(device: Any) -> Iterator[None]:
    """The same bits whatever the number of cores; samples are what is parallel."""
    import torch

    before = torch.get_num_threads()
    if device.type == "cpu":
        torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
