"""Qwen2.5-VL as a predictor: it sees the prefix, is told of it, and writes programs."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from typing import TYPE_CHECKING, Any

from mpmworlds.baselines.learned.extras import need
from mpmworlds.baselines.learned.writing import (
    VERSIONS,
    Written,
    check_question,
    question,
    read_reply,
)
from mpmworlds.baselines.protocol import Failure, Task
from mpmworlds.baselines.vlm.places import QWEN, Place, check_trained, located
from mpmworlds.baselines.vlm.sampling import Sampling
from mpmworlds.loaders.prompts import PICTURES

if TYPE_CHECKING:
    from mpmworlds.baselines.vlm.writer import Reply, Where, Writer


class CodeWriter:
    """Asks a checkpoint of Qwen2.5-VL for programs, and answers with all it wrote.

    Parameters
    ----------
    checkpoint
        Folder that `mpmworlds train vlm` or ``save_pretrained`` wrote, or name on the
        Hub.
    candidates, samples_per_call, temperature, top_p, max_new_tokens, seed
        How replies are drawn, see `Sampling`.
    pictures
        Number of frames of the prefix that are shown; 0 for none.
    task
        What is asked for: ``program`` or ``scene``.
    schema
        Whether the JSON Schema of scenes is told with the latter; `train` tells none.
    revision
        Of a repository on the Hub.
    dtype, device, device_map
        Where the model is loaded, see `Where`.
    """

    name = "vlm"
    packages = ("torch", "transformers")
    exclusive = True  # a model is loaded once

    def __init__(
        self,
        checkpoint: str = QWEN,
        candidates: int = 15,
        samples_per_call: int = 5,
        temperature: float = 1.0,
        top_p: float = 0.95,
        max_new_tokens: int = 8192,
        pictures: int = PICTURES,
        seed: int = 0,
        task: str = "program",
        schema: bool = False,
        revision: str = "",
        dtype: str = "auto",
        device: str = "auto",
        device_map: str = "",
    ) -> None:
        need("vlm", "torch", "transformers", "accelerate", "PIL", "markdown_it")
        check_question(pictures, task)
        self._how = Sampling(
            candidates, samples_per_call, temperature, top_p, max_new_tokens, seed
        )
        self._checkpoint, self._revision = checkpoint, revision
        self._pictures, self._wanted, self._schema = pictures, task, schema
        self._placing = {"device": device, "device_map": device_map, "dtype": dtype}

    @property
    def configuration(self) -> Mapping[str, Any]:
        """What decides its answers: weights, words, sampling, precision.

        Asking for it finds the checkpoint and checks that it fits, before anything is
        scored.
        """
        from mpmworlds.baselines.vlm.writer import check_memory

        check_memory(self._place.folder, self._where, self._how)
        _, dtype = self._where.resolved()
        local = "weights_sha256" in self._place.identity
        return {
            "checkpoint": "" if local else self._checkpoint,  # what is in it counts
            **self._place.identity,
            **VERSIONS,
            **asdict(self._how),
            "pictures": self._pictures,
            "task": self._wanted,
            "schema": self._schema,
            "dtype": dtype,
        }

    @cached_property
    def _where(self) -> "Where":
        from mpmworlds.baselines.vlm.writer import Where

        return Where(**self._placing)

    @cached_property
    def _place(self) -> Place:
        place = located(self._checkpoint, self._revision)
        check_trained(place.folder, self._wanted)
        return place

    @cached_property
    def _writer(self) -> "Writer":
        from mpmworlds.baselines.vlm.writer import Writer, check_memory

        check_memory(self._place.folder, self._where, self._how)
        return Writer(self._place.folder, self._where)

    def predict(self, task: Task) -> Sequence[Written]:
        """Return a program, or why there is none, for each reply."""
        asked = question(task, self._pictures, self._wanted, schema=self._schema)
        replies = self._writer.replies(asked, self._how, task.id)
        return [self._read(reply) for reply in replies]

    def _read(self, reply: "Reply") -> Written:
        if not reply.whole:
            most = self._how.max_new_tokens
            return Failure("truncated", f"no end within {most} tokens")
        return read_reply(reply.text, self._wanted)
