"""Which endpoint to ask, which model, and how patient to be."""

import os
from dataclasses import dataclass, field
from typing import Final, Self
from urllib.parse import urlsplit

URL: Final = "OPENAI_BASE_URL"
KEY: Final = "OPENAI_API_KEY"
MODEL: Final = "MPMWORLDS_LLM_MODEL"
PUBLIC_URL: Final = "https://api.openai.com/v1"  # of an unset OPENAI_BASE_URL
NO_KEY: Final = "none"  # local servers take any


@dataclass(frozen=True)
class Endpoint:
    """An OpenAI-compatible endpoint.

    Attributes
    ----------
    base_url
        Address below which `/chat/completions` lies.
    api_key
        Secret that is sent to it; it is shown and stored nowhere.
    """

    base_url: str
    api_key: str = field(repr=False)

    @classmethod
    def from_environment(cls) -> Self:
        """Endpoint of OPENAI_BASE_URL and OPENAI_API_KEY.

        Raises
        ------
        ValueError
            If the address is no HTTP address, or the key of the public one is missing.
        """
        url = os.environ.get(URL) or PUBLIC_URL
        key = os.environ.get(KEY, "").strip()
        if not (key.isascii() and key.isprintable()):
            raise ValueError(f"{KEY} has characters that no key has; set it again")
        try:
            parts = urlsplit(url)
            valid = parts.scheme in ("http", "https") and bool(parts.hostname)
            valid = valid and parts.port != 0  # raises if it is no number
        except ValueError:
            valid = False
        if not valid:
            raise ValueError(
                f"{URL} = {url!r}, must be an HTTP address such as "
                "http://localhost:8000/v1"
            )
        if not key and url == PUBLIC_URL:
            raise ValueError(
                f"{KEY} is not set; set it to your key for {PUBLIC_URL}, or set {URL} "
                "to the address of another server, such as http://localhost:8000/v1"
            )
        return cls(url, key or NO_KEY)

    def __str__(self) -> str:
        """Address without user, password and query."""
        parts = urlsplit(self.base_url)
        host = parts.netloc.rpartition("@")[2]
        return f"{parts.scheme}://{host}{parts.path}"


@dataclass(frozen=True)
class Patience:
    """How often and how long to try.

    Attributes
    ----------
    attempts
        How often one request is tried in all.
    first_wait
        Wait before the second attempt, doubled for each further one [s].
    longest_wait
        Cap of a wait; a server that asks for a longer one ends the run [s].
    timeout
        How long an attempt may take [s].
    """

    attempts: int = 6
    first_wait: float = 1.0
    longest_wait: float = 120.0
    timeout: float = 300.0

    def __post_init__(self) -> None:
        if self.attempts < 1:
            raise ValueError(f"attempts = {self.attempts}, must be at least 1")
        if not self.timeout > 0:
            raise ValueError(f"timeout = {self.timeout} s, must be more than 0")

    def wait(self, failures: int) -> float:
        """Wait after so many failed attempts if the server names none [s]."""
        doubled = self.first_wait * 2.0 ** min(failures - 1, 60)
        return min(doubled, self.longest_wait)


def model_name(given: str | None) -> str:
    """Model that is asked for: as given, or of MPMWORLDS_LLM_MODEL.

    Raises
    ------
    ValueError
        If neither names one.
    """
    name = given or os.environ.get(MODEL)
    if not name:
        raise ValueError(
            f"no model is named; give --model or set {MODEL} to a name that the "
            "server knows"
        )
    return name
