"""Chat completions of an endpoint, through all the ways in which it may fail."""

import email.utils
import json
import logging
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from mpmworlds.builder.llm.endpoint import KEY, NO_KEY, URL, Endpoint, Patience
from mpmworlds.builder.llm.stream import BrokenOffError, Listen, gathered

log = logging.getLogger(__name__)
TRANSIENT: Final = {408, 409, 429}  # and all from 500 on
NO_QUOTA: Final = "insufficient_quota"  # a 429 that waiting does not cure
SHOWN: Final = 200  # characters of what a server says
REFUSED: Final = {400, 415, 422, 501}  # of a request with what a server has not
# What is asked for where the server has it, and how a refusal tells that it has not.
EXTRAS: Final = {
    "response_format": ("response_format", "schema", "grammar"),
    "stream_options": ("stream_options", "include_usage"),
    "stream": ("stream",),
}
ONLY_ONE: Final = re.compile(r"""['"`]n['"`]""")  # of the candidates per request
STREAMED: Final = {"stream_options": {"include_usage": True}, "stream": True}


class EndpointError(RuntimeError):
    """The endpoint gives no answer, and asking again now would not help."""


class _Again(Exception):
    """An attempt failed in a way that may pass."""

    def __init__(self, problem: str, remedy: str, wait: float | None = None) -> None:
        self.problem = problem
        self.remedy = remedy
        self.wait = wait
        super().__init__(problem)


@dataclass(frozen=True)
class Reply:
    """What the endpoint said.

    Attributes
    ----------
    body
        The chat completion, with a list `choices`.
    retries
        Failed attempts before it.
    structured
        Whether the model was kept to the schema that was asked for, as far as the
        server tells: it did not refuse to.
    """

    body: dict[str, Any]
    retries: int
    structured: bool = False


class Pace:
    """At most so many starts per minute, evenly spaced.

    Parameters
    ----------
    per_minute
        Starts per minute [1/min]; without limit if None.
    """

    def __init__(self, per_minute: float | None) -> None:
        if per_minute is not None and not per_minute > 0:
            raise ValueError(f"requests per minute = {per_minute}, must be more than 0")
        self._gap = 60.0 / per_minute if per_minute else 0.0
        self._next = 0.0

    def wait(self) -> None:
        """Sleep until the next start is due."""
        time.sleep(max(self._next - time.monotonic(), 0.0))
        self._next = time.monotonic() + self._gap


class Client:
    """A client of one endpoint.

    Parameters
    ----------
    endpoint
        Where to ask.
    patience
        How often and how long to try.
    requests_per_minute
        Limit of attempts, retries among them [1/min].
    response_format
        What every answer shall be like, for servers that have it; see `structured`.

    Raises
    ------
    RuntimeError
        If the package `openai` is not installed.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        patience: Patience,
        requests_per_minute: float | None = None,
        response_format: Mapping[str, Any] | None = None,
    ) -> None:
        try:
            from openai import OpenAI
        except ImportError as error:
            raise RuntimeError(
                "asking a language model needs the package openai; "
                "pip install 'mpmworlds[llm]'"
            ) from error
        self.endpoint = endpoint
        self._patience = patience
        self._pace = Pace(requests_per_minute)
        self._openai = OpenAI(
            base_url=endpoint.base_url,
            api_key=endpoint.api_key,
            timeout=patience.timeout,
            max_retries=0,  # retries are counted, paced and limited here
        )
        form = {"response_format": response_format} if response_format else {}
        self._extras: dict[str, Any] = form | STREAMED
        self._answered = False

    def ask(self, payload: dict[str, Any], listen: Listen = lambda _: None) -> Reply:
        """Send one chat completion request, again and again if need be.

        Parameters
        ----------
        payload
            Arguments of the request: model, messages, n, seed, ...
        listen
            Called with the number of pieces that have come, while a server writes; with
            0 when the request is sent.

        Returns
        -------
        Reply
            The first sound answer.

        Raises
        ------
        EndpointError
            If the endpoint cannot be reached, refuses the request, or fails as often as
            patience allows.
        """
        for failures in range(1, self._patience.attempts + 1):
            try:
                body = self._attempt(payload, listen)
                structured = "response_format" in self._extras
                return Reply(body, failures - 1, structured)
            except _Again as again:
                last = again
            if failures < self._patience.attempts:
                self._sleep(last, failures)
        raise EndpointError(
            f"{self.endpoint}: {last.problem}, {self._patience.attempts} times in a "
            f"row; {last.remedy}"
        )

    def _sleep(self, again: _Again, failures: int) -> None:
        wait = self._patience.wait(failures) if again.wait is None else again.wait
        if wait > self._patience.longest_wait:
            raise EndpointError(
                f"{self.endpoint}: {again.problem} and asks to wait {wait:.0f} s, more "
                f"than {self._patience.longest_wait:.0f} s; come back then"
            )
        log.warning(
            "%s: %s; trying again in %.1f s", self.endpoint, again.problem, wait
        )
        time.sleep(wait)

    def _attempt(self, payload: dict[str, Any], listen: Listen) -> dict[str, Any]:
        import openai

        while True:
            self._pace.wait()
            listen(0)
            try:
                body = self._send(payload, listen)
            except openai.APIStatusError as error:
                if not self._does_without(error):
                    raise self._of_status(error) from error
            except openai.APITimeoutError as error:
                raise _Again(
                    f"no answer within {self._patience.timeout:g} s",
                    "raise --timeout, or ask for fewer candidates by --n",
                ) from error
            except openai.APIConnectionError as error:
                raise _Again(
                    f"cannot be reached ({error.__cause__ or error})",
                    f"start the server, or set {URL} to the address of one that is "
                    "OpenAI-compatible, such as http://localhost:8000/v1",
                ) from error
            except (openai.APIError, BrokenOffError, json.JSONDecodeError) as error:
                said = _shown(self._masked(str(error)))  # in the midst of an answer
                raise _Again(
                    f"breaks off ({said})", "look at the server's log"
                ) from error
            else:
                self._answered = True
                return body

    def _send(self, payload: dict[str, Any], listen: Listen) -> dict[str, Any]:
        """Chat completion of a server that answers, in pieces or at once."""
        create = self._openai.chat.completions.with_streaming_response.create
        with create(**(payload | self._extras)) as answer:
            if "text/event-stream" in answer.headers.get("content-type", ""):
                return gathered(answer.parse(), listen)
            return _completion(answer.read().decode("utf-8", "replace"))

    def _does_without(self, error: Any) -> bool:
        """Whether to ask again for less, because a server refuses what it has not."""
        if self._answered or error.status_code not in REFUSED:
            return False
        said = error.response.text.lower()
        for name, signs in EXTRAS.items():
            if name in self._extras and any(sign in said for sign in signs):
                del self._extras[name]
                log.warning("%s: has no %s; asking without", self.endpoint, name)
                return True
        if ONLY_ONE.search(said) and "n" not in self._extras:
            self._extras["n"] = 1
            log.warning("%s: gives one candidate per request", self.endpoint)
            return True
        return False

    def _of_status(self, error: Any) -> EndpointError | _Again:
        """What an HTTP status that is no success means."""
        status, body = error.status_code, error.body
        said = body.get("message") if isinstance(body, dict) else None
        said = self._masked(str(said or error.response.text or error.message))
        problem = f"answers {status} ({_shown(said)})"
        if status == 429 and error.code != NO_QUOTA:
            wait = _retry_after(error.response.headers)
            return _Again(problem, "lower --requests-per-minute", wait)
        if (status in TRANSIENT and status != 429) or status >= 500:
            wait = _retry_after(error.response.headers)
            return _Again(problem, "look at the server's log", wait)
        remedy = "change the request, or ask another server"
        if status in (401, 403):
            remedy = f"set {KEY} to a key that it accepts"
        elif status == 404:
            remedy = f"check --model, and {URL}, which most often ends in /v1"
        elif status == 429:
            remedy = f"pay for more, or set {KEY} to another key"
        return EndpointError(f"{self.endpoint}: {problem}; {remedy}")

    def _masked(self, said: str) -> str:
        """What a server says, without the secret that it may repeat."""
        key = self.endpoint.api_key
        return said if key == NO_KEY else without_key(said, key)


def without_key(text: str, key: str) -> str:
    """A text with a key masked where it stands on its own, not within a word."""
    return re.sub(rf"(?<![\w-]){re.escape(key)}(?![\w-])", "***", text)


def _completion(text: str) -> dict[str, Any]:
    """The chat completion in the text of an answer."""
    try:
        body = json.loads(text)
    except (ValueError, RecursionError):
        body = None
    if not isinstance(body, dict) or not isinstance(body.get("choices"), list):
        raise _Again(
            f"answers with what is no chat completion ({_shown(text)})",
            f"check {URL}, which most often ends in /v1",
        )
    return body


def _shown(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


def _retry_after(headers: Any) -> float | None:
    """Wait that a server asks for [s], or None: a number of seconds, or a date."""
    value = headers.get("retry-after", "")
    if re.fullmatch(r"\d{1,9}(\.\d+)?", value):
        return float(value)
    try:
        date = email.utils.parsedate_to_datetime(value)
    except ValueError:
        return None
    return max(date.timestamp() - time.time(), 0.0)
