"""Numbered requests: the k-th of a run is the same whenever it is asked."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any, Literal

from mpmworlds.builder.llm.prompts import child_messages, parent_messages, wording
from mpmworlds.builder.recipes.streams import stream
from mpmworlds.sim.scene.scene import Scene

Kind = Literal["parents", "children"]
FEWEST_EXAMPLES, MOST_EXAMPLES = 2, 3


@dataclass(frozen=True)
class Sampling:
    """What is asked of whom.

    Attributes
    ----------
    model
        Name that the server knows.
    root_seed
        Seed of all streams.
    n
        Candidates per request.
    programs
        Ask for programs beside the scenes.
    temperature, max_tokens
        Sent if not None; else the server's own.
    wording
        Version of what the model is told.
    """

    model: str
    root_seed: int
    n: int = 4
    programs: bool = False
    temperature: float | None = None
    max_tokens: int | None = None
    wording: str = "v1"

    def __post_init__(self) -> None:
        if self.n < 1:
            raise ValueError(f"n = {self.n}, must be at least 1 candidate per request")


@dataclass(frozen=True)
class Request:
    """One request.

    Attributes
    ----------
    key
        Its kind, its number, and a digest of what is sent.
    payload
        What is sent.
    seeds
        Names of the seeds that it shows, for parents.
    parent
        Name of the scene that is edited, for children; else empty.
    edit
        Name of the structured edit, for children; else empty.
    """

    key: str
    payload: dict[str, Any]
    seeds: tuple[str, ...] = ()
    parent: str = ""
    edit: str = ""


def request_of(label: str, payload: dict[str, Any]) -> Request:
    """A request of another kind, whose key begins with a label."""
    return Request(_key(label, payload), payload)


def parent_requests(seeds: Mapping[str, Scene], how: Sampling) -> Iterator[Request]:
    """Endless requests for new scenes.

    Parameters
    ----------
    seeds
        Scenes to draw two or three examples from, by name.
    how
        What is asked of whom.

    Yields
    ------
    Request
        The k-th depends on the seeds, `how` and k only.

    Raises
    ------
    ValueError
        If there are fewer than two seeds.
    """
    names = sorted(seeds)
    if len(names) < FEWEST_EXAMPLES:
        raise ValueError(
            f"{len(names)} seeds to show, must be at least {FEWEST_EXAMPLES}"
        )
    for k in count():
        rng = stream(how.root_seed, "llm", "parents", str(k))
        most = min(MOST_EXAMPLES, len(names))
        number = int(rng.integers(FEWEST_EXAMPLES, most + 1))
        chosen = [names[i] for i in rng.permutation(len(names))[:number]]
        examples = {name: seeds[name] for name in chosen}
        payload = {
            "messages": parent_messages(
                examples, programs=how.programs, version=how.wording
            ),
            "seed": int(rng.integers(2**31)),
        } | _sampling(how)
        key = _key(f"parents-{k:05d}", payload)
        yield Request(key, payload, seeds=tuple(sorted(chosen)))


def child_requests(parents: Mapping[str, Scene], how: Sampling) -> Iterator[Request]:
    """Endless requests for edited scenes.

    Parameters
    ----------
    parents
        Scenes to edit, by name; one is drawn for each request, and an edit.
    how
        What is asked of whom.

    Yields
    ------
    Request
        The k-th depends on the parents, `how` and k only.

    Raises
    ------
    ValueError
        If there is no parent.
    """
    names = sorted(parents)
    if not names:
        raise ValueError("no scene to edit; give at least one parent")
    for k in count():
        rng = stream(how.root_seed, "llm", "children", str(k))
        parent = str(rng.choice(names))
        edit = str(rng.choice(sorted(wording(how.wording).edits)))
        payload = {
            "messages": child_messages(
                parents[parent], edit, programs=how.programs, version=how.wording
            ),
            "seed": int(rng.integers(2**31)),
        } | _sampling(how)
        key = _key(f"children-{k:05d}", payload)
        yield Request(key, payload, parent=parent, edit=edit)


def top_up(request: Request, number: int, missing: int) -> Request:
    """Request for the candidates that a server still owes.

    Parameters
    ----------
    request
        The first request.
    number
        How many were sent for it already, itself among them.
    missing
        How many candidates are owed.

    Returns
    -------
    Request
        The same with another seed, for so many candidates; the request itself if it is
        the first.
    """
    if number == 0:
        return request
    rng = stream(request.payload["seed"], "llm", "top-up", str(number))
    payload = request.payload | {"seed": int(rng.integers(2**31)), "n": missing}
    key = _key(f"{request.key}-t{number}", payload)
    return Request(key, payload, request.seeds, request.parent, request.edit)


def _sampling(how: Sampling) -> dict[str, Any]:
    sent = {"temperature": how.temperature, "max_tokens": how.max_tokens}
    return {"model": how.model, "n": how.n} | {
        name: value for name, value in sent.items() if value is not None
    }


def _key(label: str, payload: dict[str, Any]) -> str:
    text = json.dumps(payload, sort_keys=True)
    return f"{label}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
