"""What asking came to: requests, tokens, and who answered."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mpmworlds.files.journal import read_records


@dataclass
class Usage:
    """Counts over transcripts."""

    requests: int = 0
    retries: int = 0
    """Failed attempts before answers came."""
    prompt_tokens: int = 0
    completion_tokens: int = 0
    models: Counter[str] = field(default_factory=Counter)
    """Requests by the name that the server gave its model."""
    endings: Counter[str] = field(default_factory=Counter)
    """Candidates by how they ended; ``length`` is cut off."""


def usage_of(transcripts: Path) -> Usage:
    """Count what is in a folder of transcripts.

    Parameters
    ----------
    transcripts
        As the predictor ``served`` was given it.
    """
    usage = Usage()
    for path in sorted(transcripts.rglob("*.jsonl")):
        for exchange in read_records(path):
            reply = exchange["reply"]
            told = reply.get("usage") or {}
            usage.requests += 1
            usage.retries += exchange["retries"]
            usage.prompt_tokens += told.get("prompt_tokens") or 0
            usage.completion_tokens += told.get("completion_tokens") or 0
            usage.models[reply.get("model") or exchange["request"]["model"]] += 1
            for choice in reply["choices"]:
                usage.endings[str(choice.get("finish_reason"))] += 1
    return usage
