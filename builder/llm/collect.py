"""A run: requests are asked until enough scenes are accepted, and these are written."""

import json
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.builder.llm.agreement import disagreements
from mpmworlds.builder.llm.client import Client
from mpmworlds.builder.llm.proposals import Accept, Asker, Filter, Proposal, propose
from mpmworlds.builder.llm.request import Request
from mpmworlds.builder.llm.tally import Tally
from mpmworlds.builder.llm.transcript import Transcript
from mpmworlds.builder.plan.families import Screen
from mpmworlds.builder.plan.screen import fault
from mpmworlds.builder.plan.trials import append_journal, read_journal
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.targets import check_file
from mpmworlds.sim.scene.scene import Scene

CANDIDATES_PER_SCENE: Final = 10  # bounds a run whose candidates are all turned down
OFTEN: Final = 0.5  # seconds between two signs of life


def collect(
    requests: Iterable[Request],
    known: Iterable[Scene],
    client: Client,
    transcript: Transcript,
    out: Path,
    *,
    count: int,
    most: int | None = None,
    screen: bool = True,
    rejections: Path | None = None,
) -> Tally:
    """Gather proposals behind a progress bar, and write them, also before a failure.

    Parameters
    ----------
    requests
        What to ask, in order; a finite number of them bounds the run.
    known
        Scenes that are no news.
    client, transcript
        Who answers, and what it has said.
    out
        Proposals go here (JSON Lines), and findings of trials beside it.
    count
        Scenes to accept.
    most
        Requests to make at most, also for what a server owes; None for no limit.
    screen
        Whether to accept only what passes a trial, as in a plan.
    rejections
        What was turned down, and why, goes here (JSON Lines).

    Returns
    -------
    Tally
        What it came to.

    Raises
    ------
    EndpointError
        If the endpoint fails for good.
    """
    for path in (out, rejections):
        check_file(path)
    journal = out.with_suffix(".trials.jsonl")
    tally = Tally()
    proposals: list[Proposal] = []
    chosen = Filter(screened(journal) if screen else _any, disagreements, tally)
    chosen.know(known)
    with tqdm(total=count, desc="propose", unit="scene", file=sys.stderr) as bar:
        asker = Asker(client, transcript, tally, most, _SignsOfLife(bar, tally))
        try:
            for proposal in propose(requests, asker, chosen):
                proposals.append(proposal)
                bar.update()
                if len(proposals) == count:
                    break
        finally:
            if proposals or not out.exists():  # else what is there is worth more
                _write(out, proposals)
            if rejections:
                _write(rejections, chosen.rejected)
    return tally


def most_requests(count: int, candidates: int) -> int:
    """Requests that a run may take, but for what a server then owes.

    Parameters
    ----------
    count
        Scenes to accept.
    candidates
        Candidates per request.
    """
    return -(-CANDIDATES_PER_SCENE * count // candidates)


def screened(journal: Path) -> Accept:
    """What takes a valid scene to the reason why its trial speaks against it, or None.

    Parameters
    ----------
    journal
        Findings of trials; new ones are added.
    """
    screen = Screen(read_journal(journal))

    def accept(scene: Scene) -> str | None:
        reason = fault(screen.findings(scene))
        if screen.new:
            append_journal(journal, screen.new)
            screen.take()
        return reason

    return accept


def _any(scene: Scene) -> None:
    """Accept whatever is valid."""


class _SignsOfLife:
    """Shows on a progress bar how far a slow server is with its answer."""

    def __init__(self, bar: Any, tally: Tally) -> None:
        self._bar, self._tally = bar, tally
        self._last = 0.0

    def __call__(self, pieces: int) -> None:
        now = time.monotonic()
        if pieces and now - self._last < OFTEN:
            return
        self._last = now
        self._bar.set_postfix(
            requests=self._tally.requests,
            rejected=self._tally.rejected.total(),
            answer=f"{pieces} tokens" if pieces else "awaited",
        )


def _write(path: Path, items: Sequence[Any]) -> None:
    lines = [json.dumps(asdict(item), sort_keys=True) + "\n" for item in items]
    write_atomically(path, "".join(lines).encode())
