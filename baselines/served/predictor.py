"""A served model as a predictor: it is asked once, and what it said is kept."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mpmworlds.baselines.learned.extras import need
from mpmworlds.baselines.learned.writing import (
    VERSIONS,
    Written,
    check_question,
    question,
    read_choice,
    seed_of,
)
from mpmworlds.baselines.protocol import Failure, InfrastructureError, Task
from mpmworlds.loaders.prompts import PICTURES, as_url

if TYPE_CHECKING:
    from mpmworlds.builder.llm.client import Client
    from mpmworlds.builder.llm.request import Request

TRANSCRIPTS: Final = "work/transcripts"


class ServedWriter:
    """Asks a server for programs, and answers with all that the model wrote.

    Address and key are OPENAI_BASE_URL and OPENAI_API_KEY. Each sample has a transcript
    of its own for each regime, so that several processes may ask at once and none asks
    what another has been told.

    Parameters
    ----------
    model
        Name that the server knows; MPMWORLDS_LLM_MODEL if empty.
    n
        Candidates per sample. A server that gives fewer is asked again.
    temperature, top_p, max_tokens
        Sent if not None; else the server's own.
    pictures
        Number of frames of the prefix that are shown; 0 for a model that sees nothing.
    task
        What is asked for: ``program`` or ``scene``.
    schema
        Whether the JSON Schema of scenes is told with the latter.
    structured
        Whether the server is asked to keep the model to that schema, if it can.
    seed
        Which draws, of servers that take seeds.
    transcripts
        Folder of requests and replies; what is in it is not asked again.
    requests_per_minute
        Limit of each process [1/min]; None for no limit.
    attempts, timeout
        How often a request is tried, and how long a server may be silent [s].
    """

    name = "served"
    packages = ("openai",)

    def __init__(
        self,
        model: str = "",
        n: int = 15,
        temperature: float | None = None,
        top_p: float | None = None,
        max_tokens: int | None = None,
        pictures: int = PICTURES,
        task: str = "program",
        schema: bool = True,
        structured: bool = False,
        seed: int = 0,
        transcripts: str = TRANSCRIPTS,
        requests_per_minute: float | None = None,
        attempts: int = 6,
        timeout: float = 300.0,
    ) -> None:
        need("served", "openai", "markdown_it")
        check_question(pictures, task)
        if n < 1:
            raise ValueError(f"n = {n}, must be at least 1 candidate")
        if structured and task != "scene":
            raise ValueError(f"structured, task = {task!r}: only scenes have a schema")
        self._model, self._seed = model, seed
        self._sent = {"temperature": temperature, "top_p": top_p}
        self._sent |= {"max_tokens": max_tokens}
        self._n, self._pictures, self._wanted = n, pictures, task
        self._schema, self._structured = schema, structured
        self._transcripts = Path(transcripts)
        self._pace = requests_per_minute
        self._patience = {"attempts": attempts, "timeout": timeout}

    @property
    def configuration(self) -> Mapping[str, Any]:
        """What decides its answers; how patiently it asks does not.

        Asking for it checks that a server and a model are named.
        """
        return {
            "model": self._named,
            "server": str(self._client.endpoint),
            **VERSIONS,
            **self._sent,
            "n": self._n,
            "pictures": self._pictures,
            "task": self._wanted,
            "schema": self._schema,
            "structured": self._structured,
            "seed": self._seed,
            "transcripts": "",
            "requests_per_minute": None,
            **dict.fromkeys(self._patience),
        }

    @cached_property
    def _named(self) -> str:
        from mpmworlds.builder.llm.endpoint import model_name

        return model_name(self._model)

    @cached_property
    def _client(self) -> "Client":
        from mpmworlds.builder.llm.client import Client
        from mpmworlds.builder.llm.endpoint import Endpoint, Patience
        from mpmworlds.builder.llm.structured import response_format

        return Client(
            Endpoint.from_environment(),
            Patience(**self._patience),  # type: ignore[arg-type]
            self._pace,
            response_format() if self._structured else None,
        )

    def predict(self, task: Task) -> Sequence[Written]:
        """Return a program, or why there is none, for each candidate.

        Raises
        ------
        InfrastructureError
            If the server gives no answer.
        """
        from mpmworlds.builder.llm.client import EndpointError
        from mpmworlds.builder.llm.proposals import Asker
        from mpmworlds.builder.llm.transcript import Transcript, TranscriptError

        request = self._request(task)
        path = self._transcripts / task.id[:2] / f"{task.id}-{task.regime}.jsonl"
        try:
            with Transcript(path) as transcript:
                asked = Asker(self._client, transcript).choices(request)
                found = [read_choice(choice, self._wanted) for _, _, choice in asked]
        except (EndpointError, TranscriptError) as error:
            raise InfrastructureError(str(error)) from error
        told = f"the server gave {len(found)} of {self._n} candidates"
        missing = [Failure("no_choice", told)] * (self._n - len(found))
        return [*found, *missing]

    def _request(self, task: Task) -> "Request":
        """The same whenever it is asked, by whatever process."""
        from mpmworlds.builder.llm.request import request_of

        asked = question(task, self._pictures, self._wanted, schema=self._schema)
        payload = {
            "model": self._named,
            "messages": asked.messages(as_url),
            "n": self._n,
            "seed": seed_of(self._seed, task.id),
        }
        payload |= {name: v for name, v in self._sent.items() if v is not None}
        return request_of(f"{task.id}@{self._client.endpoint}", payload)
