"""Continuation by a video diffusion model, and what its encoder of videos would reach.

Predictions that were made elsewhere need none of this: `mpmworlds evaluate
--predictions FOLDER` scores them.
"""

import hashlib
import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.learned.extras import need
from mpmworlds.baselines.protocol import (
    Answers,
    Candidate,
    InfrastructureError,
    Task,
)
from mpmworlds.baselines.vdm.backends.protocol import (
    Backend,
    BackendModule,
    Options,
    backend_module,
)
from mpmworlds.baselines.vdm.canvas import Canvas
from mpmworlds.baselines.vdm.chunks import check_lengths, continue_clip, plan_chunks
from mpmworlds.baselines.vdm.memory import STRIDE, Clip
from mpmworlds.baselines.vdm.text import MOST_TOKENS, TEXT_VERSION, text_for
from mpmworlds.baselines.vdm.weights import FAMILY, check_base, trained_with
from mpmworlds.metrics.reduction import SIDE

log = logging.getLogger(__name__)

MODULES: Final = ("torch", "diffusers", "transformers", "peft")


def needs() -> None:
    """Raise `MissingExtraError` unless the packages are there."""
    need(FAMILY, *MODULES)


class Vdm:
    """Continues the prefix chunk by chunk; the text is what the regime tells.

    What is left out is as the LoRA was trained, or as the backend has it. The same
    seed, device and versions give the same frames; other devices round otherwise.

    Parameters
    ----------
    checkpoint
        Folder of a pipeline, or its name on the Hub.
    backend
        One of `backends.protocol.BACKENDS`.
    lora
        What `mpmworlds train vdm` has written, or a file of LoRA weights.
    steps, guidance, shift
        Of the sampler, see `backends.protocol.Options`.
    chunk, overlap
        Frames of a call, and those of them that are given, both 4 k + 1.
    size
        Side that frames are resized to. [px] Their own, rounded up, if left out.
    seed
        With the name of a task, that of all its noise.
    dtype, device
        As torch names them, or `auto`.
    revision
        Of the repository on the Hub.
    text_device
        Where texts are encoded, `cpu` to save the memory of a GPU; as `device` if
        empty.
    checkout
        Folder of the code of LongCat-Video, for that backend.
    """

    name = "vdm"
    packages = ("torch", "diffusers", "transformers")
    exclusive = True  # a GPU has room for one model

    def __init__(
        self,
        checkpoint: str = "",
        backend: str = "wan_vace",
        lora: str = "",
        steps: int = 50,
        guidance: float = 5.0,
        shift: float = 3.0,
        chunk: int | None = None,
        overlap: int | None = None,
        size: int | None = None,
        seed: int = 0,
        dtype: str = "auto",
        device: str = "auto",
        revision: str = "",
        text_device: str = "",
        checkout: str = "",
    ) -> None:
        self._backend = backend
        self._given = {"chunk": chunk, "overlap": overlap, "size": size}
        self._seed = seed
        self._cut = self._told = 0
        self._asked = Options(
            checkpoint=checkpoint,
            revision=revision,
            lora=lora,
            steps=steps,
            guidance=guidance,
            shift=shift,
            dtype=dtype,
            device=device,
            text_device=text_device,
            checkout=checkout,
        )

    @cached_property
    def configuration(self) -> Mapping[str, Any]:
        """What tells results apart; raises what stands in the way of all of them.

        Raises
        ------
        FileNotFoundError, ValueError
            If there is no such backend, checkpoint or LoRA, or a length is impossible.
        MissingExtraError, TooLittleMemoryError, RuntimeError
            If a package, memory or the device is missing.
        """
        form = self._form
        size = form["size"] or SIDE
        clip = Clip(form["chunk"], size, size)
        weights = self._module.checked(self._options, clip)
        check_base(self._asked.lora, weights)
        return {
            "backend": self._backend,
            "trained_on": self._trained.get("regime", ""),
            "text": TEXT_VERSION,
            "seed": self._seed,
            "steps": self._options.steps,
            "guidance": self._options.guidance,
            "shift": self._options.shift,
            **form,
            **weights,
        }

    def predict(self, task: Task) -> Sequence[Candidate]:
        """Predict one sample: one candidate.

        Raises
        ------
        InfrastructureError, MemoryError
            If the model cannot be loaded, or has too little memory.
        """
        model = self._model
        text = text_for(task.side_info)
        self._count(task, model.count_tokens(text))
        form = self._form
        height, width = task.prefix.shape[1:3]
        canvas = Canvas(height, width, self._module.MULTIPLE, form["size"])
        plan = plan_chunks(
            len(task.prefix), task.horizon, form["chunk"], form["overlap"]
        )
        try:
            frames = continue_clip(
                model,
                canvas.put(task.prefix),
                text,
                task.horizon,
                plan,
                lambda number: seed_of(self._seed, task.id, number),
            )
        except RuntimeError as error:
            if type(error).__name__ != "OutOfMemoryError":  # that of torch
                raise
            raise MemoryError(str(error).partition("\n")[0]) from None
        return [Candidate(canvas.take(frames))]

    @cached_property
    def _module(self) -> BackendModule:
        needs()
        return backend_module(self._backend)

    @cached_property
    def _trained(self) -> Mapping[str, Any]:
        return trained_with(self._asked.lora)

    @cached_property
    def _options(self) -> Options:
        """As asked, with the checkpoint that the LoRA was trained on."""
        if self._asked.checkpoint:
            return self._asked
        of_base = {
            name: self._trained.get(name, "") for name in ("checkpoint", "revision")
        }
        return replace(self._asked, **of_base)

    @cached_property
    def _form(self) -> dict[str, Any]:
        defaults = {"chunk": self._module.CHUNK, "overlap": self._module.OVERLAP}
        given = {k: value for k, value in self._given.items() if value is not None}
        trained = {k: self._trained[k] for k in self._given if k in self._trained}
        form: dict[str, Any] = {"size": None} | defaults | trained | given
        check_lengths(form["chunk"], form["overlap"])
        return form

    @cached_property
    def _model(self) -> Backend:
        try:
            return self._module.open_backend(self._options)
        except Exception as error:
            raise InfrastructureError(
                f"vdm: {self._backend} cannot be loaded: {error}"
            ) from error

    def _count(self, task: Task, tokens: int) -> None:
        """Tell what the model does not read, which results do not show."""
        self._told += 1
        if tokens > MOST_TOKENS:
            self._cut += 1
            log.warning(
                "text of task %s has %d tokens, the model reads %d; so have %d of %d "
                "so far",
                task.id,
                tokens,
                MOST_TOKENS,
                self._cut,
                self._told,
            )


def seed_of(seed: int, task: str, chunk: int) -> int:
    """Seed of a chunk of a task, whatever else is predicted before."""
    digest = hashlib.sha256(f"{seed} {task} {chunk}".encode()).digest()
    return int.from_bytes(digest[:7], "big")


class Vae:
    """The truth through the encoder of videos and back: the ceiling of the family.

    Parameters
    ----------
    checkpoint, revision
        As of `Vdm`, with the backend `wan_vace`.
    size
        As of `Vdm`.
    device
        As of `Vdm`.
    """

    name = "vae"
    packages = ("torch", "diffusers")
    exclusive = True

    def __init__(
        self,
        checkpoint: str = "",
        size: int | None = None,
        device: str = "auto",
        revision: str = "",
    ) -> None:
        self._checkpoint = checkpoint
        self._size = size
        self._device = device
        self._revision = revision

    @cached_property
    def configuration(self) -> Mapping[str, Any]:
        """What tells results apart; raises as that of `Vdm`."""
        needs()
        from mpmworlds.baselines.vdm.backends.vae import told_of

        told = told_of(self._checkpoint, self._revision, self._device)
        return {**told, "size": self._size}

    def reveal(self, task: Task, answers: Answers) -> Sequence[Candidate]:
        """Return what comes back.

        The last frame of the prefix goes before, as the encoder's first frame is a
        latent of its own, and the last frame is repeated until four make a latent.
        """
        from mpmworlds.baselines.vdm.backends.vae import MULTIPLE

        truth = answers.continuation
        height, width = truth.shape[1:3]
        canvas = Canvas(height, width, MULTIPLE, self._size)
        frames = canvas.put(np.concatenate([task.prefix[-1:], truth]))
        frames = np.pad(
            frames, ((0, -len(truth) % STRIDE), (0, 0), (0, 0), (0, 0)), mode="edge"
        )
        back = self._round_trip(frames)[1 : 1 + len(truth)]
        return [Candidate(canvas.take(back))]

    @cached_property
    def _round_trip(self) -> Any:
        from mpmworlds.baselines.vdm.backends.vae import open_round_trip

        try:
            return open_round_trip(self._checkpoint, self._revision, self._device)
        except Exception as error:
            raise InfrastructureError(f"vae: cannot be loaded: {error}") from error
