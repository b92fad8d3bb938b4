"""What a run came to: requests, tokens, scenes and programs by their fate, price."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from mpmworlds.builder.llm.transcript import Exchange


@dataclass
class Tally:
    """Counts of a run, filled as it goes.

    Attributes
    ----------
    requests
        Requests that belong to the run, answered now or before.
    reused
        Those of them that the transcript had answered already.
    retries
        Failed attempts before the answers came.
    prompt_tokens, completion_tokens
        As the endpoint counts them, over all requests of the run.
    accepted
        Scenes that were accepted.
    rejected
        Candidates that were not, by reason.
    programs
        Programs beside accepted scenes: "kept", or why not.
    """

    requests: int = 0
    reused: int = 0
    retries: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    accepted: int = 0
    rejected: Counter[str] = field(default_factory=Counter)
    programs: Counter[str] = field(default_factory=Counter)

    def add(self, exchange: Exchange, *, reused: bool) -> None:
        """Count a request and its reply."""
        self.requests += 1
        self.reused += int(reused)
        self.retries += exchange.retries
        self.prompt_tokens += _tokens(exchange, "prompt_tokens")
        self.completion_tokens += _tokens(exchange, "completion_tokens")

    def price(self, price_in: float, price_out: float) -> float:
        """Price of all tokens.

        Parameters
        ----------
        price_in, price_out
            Of a million tokens of prompts, and of completions [currency].

        Returns
        -------
        float
            In the same currency.
        """
        return 1e-6 * (
            price_in * self.prompt_tokens + price_out * self.completion_tokens
        )

    def to_data(self) -> dict[str, Any]:
        """The counts as plain data, reasons sorted by name."""
        return {
            "requests": self.requests,
            "reused": self.reused,
            "retries": self.retries,
            "prompt_tokens": self.prompt_tokens,
            "completion_tokens": self.completion_tokens,
            "accepted": self.accepted,
            "rejected": dict(sorted(self.rejected.items())),
            "programs": dict(sorted(self.programs.items())),
        }


def _tokens(exchange: Exchange, name: str) -> int:
    """Count of tokens in a reply; 0 where the server gives none."""
    usage = exchange.reply.get("usage")
    number = usage.get(name) if isinstance(usage, dict) else None
    return number if isinstance(number, int) else 0
