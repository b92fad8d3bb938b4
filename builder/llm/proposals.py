"""Proposals: scenes of a language model that passed every filter."""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from mpmworlds.builder.llm.client import Client, EndpointError
from mpmworlds.builder.llm.replies import Rejection, Suggestion, read_choice
from mpmworlds.builder.llm.request import Request, top_up
from mpmworlds.builder.llm.stream import Listen
from mpmworlds.builder.llm.tally import Tally
from mpmworlds.builder.llm.transcript import Exchange, Transcript
from mpmworlds.sim.scene.scene import Scene

Accept = Callable[[Scene], str | None]
CheckProgram = Callable[[Scene, str], list[str]]
APPEARANCE: Final = ("name", "visualization")  # what makes no other world


@dataclass(frozen=True)
class Proposal:
    """An accepted scene.

    Attributes
    ----------
    seeds
        Names of the seeds that the model saw.
    parent
        Name of the scene that was edited; empty for a parent.
    edit
        Operator "llm", model, key of the request, number of the choice; for a child
        also the name of the structured edit.
    scene
        Canonical YAML.
    program
        The model's own program if it agrees with the scene, else None.
    """

    seeds: tuple[str, ...]
    parent: str
    edit: dict[str, Any]
    scene: str
    program: str | None


@dataclass(frozen=True)
class Rejected:
    """A candidate, or the program of one, that was turned down.

    Attributes
    ----------
    request
        Key of the request.
    choice
        Number of the choice in its reply.
    reason
        What is counted; "program" if only the program was turned down.
    detail
        What exactly was wrong.
    """

    request: str
    choice: int
    reason: str
    detail: str


@dataclass
class Asker:
    """Asks an endpoint what the transcript does not know yet.

    Attributes
    ----------
    client
        The endpoint.
    transcript
        What it has said.
    tally
        Where requests and tokens are counted.
    most
        Requests to make or look up at most; None for no limit.
    listen
        Told how many pieces of an answer have come, see `Client.ask`.
    """

    client: Client
    transcript: Transcript
    tally: Tally = field(default_factory=Tally)
    most: int | None = None
    listen: Listen = lambda _: None

    def choices(self, request: Request) -> Iterator[tuple[str, int, Any]]:
        """Choices for a request, topped up where a server gives fewer than asked.

        Parameters
        ----------
        request
            The request; its payload says how many.

        Yields
        ------
        str, int, object
            Key of the request that was answered, number of the choice, its plain data.

        Raises
        ------
        EndpointError
            If the endpoint fails; says where the replies so far are kept.
        """
        wanted = int(request.payload["n"])
        missing = wanted
        for number in range(wanted):  # a server may give one at a time, or none
            if missing == 0 or self.tally.requests == self.most:
                return
            part = top_up(request, number, missing)
            choices = self._exchange(part).reply["choices"][:missing]
            missing -= len(choices)
            if not choices:
                self.tally.rejected["no_choices"] += 1
            for i, choice in enumerate(choices):
                yield part.key, i, choice

    def _exchange(self, request: Request) -> Exchange:
        exchange = self.transcript.get(request.key)
        reused = exchange is not None
        if exchange is None:
            try:
                reply = self.client.ask(request.payload, self.listen)
            except EndpointError as error:
                raise EndpointError(
                    f"{error}. {len(self.transcript)} replies are kept in "
                    f"{self.transcript.path}; run the same command again to go on"
                ) from error
            exchange = Exchange(
                request.key,
                request.payload,
                reply.body,
                reply.retries,
                reply.structured,
            )
            self.transcript.append(exchange)
        self.tally.add(exchange, reused=reused)
        return exchange


@dataclass
class Filter:
    """Turns choices into proposals, and counts and records what it turns down.

    Attributes
    ----------
    accept
        Takes a scene to None, or to a reason; its text up to a colon is counted.
    check_program
        Takes a scene and a program to what they disagree in.
    tally
        Where fates are counted.
    rejected
        What was turned down, in order.
    """

    accept: Accept
    check_program: CheckProgram
    tally: Tally
    rejected: list[Rejected] = field(default_factory=list)
    _worlds: set[str] = field(default_factory=set)

    def know(self, scenes: Iterable[Scene]) -> None:
        """Take scenes as known, so that copies of them are duplicates."""
        self._worlds.update(map(world, scenes))

    def proposal(
        self, request: Request, key: str, number: int, choice: Any
    ) -> Proposal | None:
        """Proposal of a choice, or None if it was turned down.

        Parameters
        ----------
        request
            The request of the run that it belongs to.
        key, number, choice
            As `Asker.choices` gives them.

        Returns
        -------
        Proposal, optional
            With the program only if it agrees.
        """
        read = read_choice(choice, f"{key}[{number}]")
        if isinstance(read, Rejection):
            self._reject(key, number, read.reason, read.detail)
            return None
        seen = world(read.scene)
        if seen in self._worlds:
            self._reject(key, number, "duplicate", "the same objects are known already")
            return None
        verdict = self.accept(read.scene)
        if verdict is not None:
            self._reject(key, number, verdict.partition(":")[0], verdict)
            return None
        self._worlds.add(seen)
        self.tally.accepted += 1
        edit = {
            "operator": "llm",
            "model": request.payload["model"],
            "request": key,
            "choice": number,
        }
        if request.edit:
            edit["edit"] = request.edit
        program = self._program(key, number, read)
        return Proposal(
            request.seeds, request.parent, edit, read.scene.to_yaml(), program
        )

    def _program(self, key: str, number: int, read: Suggestion) -> str | None:
        """The one program of a candidate if it agrees with the scene."""
        if not read.programs:
            self.tally.programs["absent"] += 1
            return None
        if len(read.programs) > 1:
            faults = [f"{len(read.programs)} programs, must be one"]
            fate = "several"
        else:
            faults = self.check_program(read.scene, read.programs[0])
            fate = "disagrees" if faults else "kept"
        self.tally.programs[fate] += 1
        if faults:
            detail = "; ".join(faults)
            self.rejected.append(Rejected(key, number, "program", detail))
            return None
        return read.programs[0]

    def _reject(self, key: str, number: int, reason: str, detail: str) -> None:
        self.tally.rejected[reason] += 1
        self.rejected.append(Rejected(key, number, reason, detail))


def propose(
    requests: Iterable[Request], asker: Asker, chosen: Filter
) -> Iterator[Proposal]:
    """Ask request after request, and yield what passes.

    Parameters
    ----------
    requests
        Requests in order; a finite number of them bounds the run.
    asker
        What answers them.
    chosen
        What turns answers into proposals.

    Yields
    ------
    Proposal
        In order of requests and choices: the same for the same transcript. Nothing is
        asked ahead of what is taken.

    Raises
    ------
    EndpointError
        If the endpoint fails for good.
    """
    for request in requests:
        for key, number, choice in asker.choices(request):
            proposal = chosen.proposal(request, key, number, choice)
            if proposal is not None:
                yield proposal


def world(scene: Scene) -> str:
    """Text that two scenes share if they differ in names, looks and order only.

    Parameters
    ----------
    scene
        A scene.

    Returns
    -------
    str
        Its surroundings and objects, without resolution, length and seed.
    """
    data = scene.to_data()
    objects = [
        json.dumps({k: v for k, v in thing.items() if k not in APPEARANCE})
        for thing in data["objects"]
    ]
    return json.dumps([data["environment"], sorted(objects)])
