"""A chat completion that comes in pieces, as the server writes it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

Listen = Callable[[int], None]


class BrokenOffError(ValueError):
    """A stream that ends before what it writes does, or goes astray."""


@dataclass
class _Choice:
    """What has come of one choice."""

    content: str = ""
    refusal: str = ""
    finish_reason: str | None = None

    def add(self, piece: dict[str, Any]) -> None:
        delta = piece.get("delta") or {}
        self.content += delta.get("content") or ""
        self.refusal += delta.get("refusal") or ""
        self.finish_reason = piece.get("finish_reason") or self.finish_reason

    def to_data(self, index: int) -> dict[str, Any]:
        message = {"role": "assistant", "content": self.content}
        if self.refusal:
            message["refusal"] = self.refusal
        return {
            "index": index,
            "finish_reason": self.finish_reason,
            "message": message,
        }


def gathered(chunks: Iterable[Any], listen: Listen) -> dict[str, Any]:
    """Put a chat completion together from its chunks.

    The client library's own accumulator takes the pieces of several choices for those
    of one if they do not come in order, and raises where a reply is cut off.

    Parameters
    ----------
    chunks
        As the library gives them.
    listen
        Called with the number of chunks so far, which is about that of tokens.

    Returns
    -------
    dict
        The body that the server would have sent in one piece.

    Raises
    ------
    BrokenOffError
        If a choice has no end, nothing came at all, or something else did.
    """
    body: dict[str, Any] = {}
    choices: dict[int, _Choice] = {}
    for number, chunk in enumerate(chunks, 1):
        try:
            data = chunk.to_dict(warnings=False)
            body |= {k: data[k] for k in ("id", "model", "usage") if data.get(k)}
            for piece in data.get("choices") or ():
                choices.setdefault(int(piece["index"]), _Choice()).add(piece)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise BrokenOffError("it sends what is no part of an answer") from error
        listen(number)
    ended = all(choice.finish_reason for choice in choices.values())
    if not ended or not (choices or "usage" in body):
        raise BrokenOffError("its answer breaks off")
    return body | {"choices": [choices[i].to_data(i) for i in sorted(choices)]}
