"""The client gets an answer through every failure that passes, and else says why."""

import socket
import sys
from email.utils import formatdate

import pytest

from mpmworlds.builder.llm.client import Client, EndpointError, without_key
from mpmworlds.builder.llm.endpoint import Endpoint, Patience, model_name
from tests.builder.llm.llm_server import KEY, error, fails, says, serving

PATIENCE = Patience(attempts=3, first_wait=0.01, timeout=0.3)
PAYLOAD = {
    "model": "m",
    "messages": [{"role": "user", "content": "hello"}],
    "n": 2,
    "seed": 5,
}
SENT = PAYLOAD | {"stream": True, "stream_options": {"include_usage": True}}


def client_of(server, patience=PATIENCE, per_minute=None):
    return Client(Endpoint(server.url, KEY), patience, per_minute)


def texts(reply):
    return [choice["message"]["content"] for choice in reply.body["choices"]]


def test_request_arrives_as_it_is_and_the_answer_comes_back():
    with serving(says("a", "b")) as server:
        reply = client_of(server).ask(PAYLOAD)
    assert (texts(reply), reply.retries) == (["a", "b"], 0)
    assert server.payloads == [SENT]
    assert server.keys == {f"Bearer {KEY}"}


@pytest.mark.parametrize(
    "failure",
    [
        error(500),
        error(503),
        error(408),
        error(409),
        error(429),
        fails(text="not JSON {"),
        fails(text='{"error": {"message": "overloaded"}}'),
        fails(text='["choices"]'),
        fails(text='{"choices": null}'),
        fails(text="[" * 100_000),
        fails(text="<html>", headers={"Content-Type": "text/html"}),
        fails(drop=True),
        fails(text="late", wait=1.0),
        says("long", pieces=2),
        says("long", pieces=0),
        says("long", pieces=2, pause=0.2, wait=0.2),
    ],
    ids=[
        *("500", "503", "408", "409", "429", "garbage", "error body", "list"),
        *("no choices", "deep", "html", "connection closed", "timeout"),
        *("breaks off", "empty stream", "breaks off late"),
    ],
)
def test_passing_failure_is_tried_again(failure):
    with serving(failure, says("a")) as server:
        reply = client_of(server).ask(PAYLOAD)
    assert (texts(reply), reply.retries) == (["a"], 1)
    assert server.payloads == [SENT, SENT]


def in_two_seconds():
    import time

    return formatdate(time.time() + 2, usegmt=True)


@pytest.mark.parametrize(
    ("header", "least", "most"),
    [("0.4", 0.4, 5.0), (in_two_seconds, 0.5, 5.0), ("soon", 0.0, 0.4)],
    ids=["seconds", "date", "nonsense"],
)
def test_retry_after_is_honoured(header, least, most):
    header = header if isinstance(header, str) else header()
    with serving(error(429, {"Retry-After": header}), says("a")) as server:
        client_of(server).ask(PAYLOAD)
    assert least <= server.times[1] - server.times[0] < most


def test_longer_wait_than_patience_ends_the_run_at_once():
    busy = error(429, {"Retry-After": "3600"})
    message = r"asks to wait 3600 s, .*than 120 s"
    with serving(busy) as server, pytest.raises(EndpointError, match=message):
        client_of(server).ask(PAYLOAD)
    assert len(server.payloads) == 1


@pytest.mark.parametrize(
    ("failure", "parts"),
    [
        (error(429), ["answers 429 (status 429)", "lower --requests-per-minute"]),
        (error(502), ["answers 502 (status 502)", "look at the server's log"]),
        (fails(text="x" * 1000), ["no chat completion (xxx", "ends in /v1"]),
        (fails(wait=1.0), ["no answer within 0.3 s", "raise --timeout"]),
        (fails(drop=True), ["cannot be reached (", "set OPENAI_BASE_URL"]),
    ],
    ids=["429", "502", "garbage", "timeout", "closed"],
)
def test_lasting_failure_ends_after_all_attempts_with_a_remedy(failure, parts):
    with serving(failure) as server, pytest.raises(EndpointError) as raised:
        client_of(server).ask(PAYLOAD)
    assert len(server.payloads) == PATIENCE.attempts
    for part in (server.url, "3 times in a row", *parts):
        assert part in str(raised.value)
    assert len(str(raised.value)) < 600


@pytest.mark.parametrize(
    ("failure", "remedy"),
    [
        (error(401), "set OPENAI_API_KEY"),
        (error(403), "set OPENAI_API_KEY"),
        (error(404), "check --model, and OPENAI_BASE_URL"),
        (error(400), "change the request"),
        (fails(status=400, text="plain"), r"answers 400 \(plain\); change"),
        (error(429, code="insufficient_quota"), "pay for more"),
    ],
    ids=["401", "403", "404", "400", "400 in plain text", "quota"],
)
def test_refusal_is_final_and_says_what_to_set(failure, remedy):
    with serving(failure) as server, pytest.raises(EndpointError, match=remedy):
        client_of(server).ask(PAYLOAD)
    assert len(server.payloads) == 1


def test_unreachable_endpoint_is_named_with_what_to_set():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{free.getsockname()[1]}/v1"
    client = Client(Endpoint(url, KEY), PATIENCE)
    with pytest.raises(EndpointError) as raised:
        client.ask(PAYLOAD)
    for part in (url, "cannot be reached", "refused", "set OPENAI_BASE_URL"):
        assert part in str(raised.value)


def test_attempts_keep_the_pace_also_when_tried_again():
    with serving(error(500), says("a")) as server:
        client = client_of(server, per_minute=300)
        for _ in range(3):
            client.ask(PAYLOAD)
    assert len(server.times) == 4
    assert server.times[-1] - server.times[0] > 0.5, "three gaps of 0.2 s"


def test_waits_double_up_to_the_cap():
    patience = Patience(first_wait=1.0, longest_wait=5.0)
    assert [patience.wait(k) for k in (1, 2, 3, 4, 5000)] == [1, 2, 4, 5, 5]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Patience(attempts=0), "attempts = 0, must be at least 1"),
        (lambda: Patience(timeout=0.0), "timeout = 0.0 s, must be more than 0"),
        (lambda: Client(Endpoint("http://x/v1", KEY), PATIENCE, 0.0), "more than 0"),
    ],
    ids=["attempts", "timeout", "rate"],
)
def test_impossible_setting_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_without_the_client_library_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "openai", None)
    with pytest.raises(RuntimeError, match=r"pip install 'mpmworlds\[llm\]'"):
        Client(Endpoint("http://x/v1", KEY), PATIENCE)


@pytest.mark.parametrize(
    ("url", "key", "message"),
    [
        ("", "", "OPENAI_API_KEY is not set"),
        ("localhost:8000", "", "OPENAI_BASE_URL = 'localhost:8000', must be an HTTP"),
        ("http://[x", "", "must be an HTTP address"),
        ("http://localhost:abc/v1", "", "must be an HTTP address"),
        ("http://localhost/v1", "sk-\u2013", "has characters that no key has"),
    ],
)
def test_unusable_environment_says_what_to_set(url, key, message, monkeypatch):
    monkeypatch.setenv("OPENAI_BASE_URL", url)
    monkeypatch.setenv("OPENAI_API_KEY", key)
    with pytest.raises(ValueError) as raised:
        Endpoint.from_environment()
    assert message in str(raised.value)


def test_local_server_needs_no_key(monkeypatch):
    monkeypatch.setenv("OPENAI_BASE_URL", "http://localhost:8000/v1")
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    assert Endpoint.from_environment().base_url == "http://localhost:8000/v1"


def test_a_key_may_end_in_a_line_break(monkeypatch):
    monkeypatch.setenv("OPENAI_API_KEY", KEY + "\n")
    assert Endpoint.from_environment().api_key == KEY


def test_a_server_that_repeats_the_key_is_not_quoted():
    answer = fails(status=401, text=f"bad key Bearer {KEY}")
    with serving(answer) as server, pytest.raises(EndpointError) as raised:
        client_of(server).ask(PAYLOAD)
    assert "bad key Bearer ***" in str(raised.value)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("the quota exceeds x.", "the quota exceeds ***."),
        ("bad key 'x'", "bad key '***'"),
        ("x", "***"),
        ("no such model x-large", "no such model x-large"),
    ],
)
def test_a_short_key_is_masked_only_where_it_stands_on_its_own(text, shown):
    assert without_key(text, "x") == shown


def test_an_answer_may_take_longer_than_any_silence_in_it():
    heard = []
    with serving(says("word " * 80, "b", pause=0.05)) as server:
        reply = client_of(server).ask(PAYLOAD, heard.append)
    assert (texts(reply), reply.retries) == (["word " * 80, "b"], 0)
    assert heard == list(range(len(heard)))
    assert len(heard) > 14, "about one a piece, the first when the request is sent"
    assert 0.05 * len(heard) > PATIENCE.timeout
    assert reply.body["usage"] == {"prompt_tokens": 100, "completion_tokens": 20}


def test_a_reply_that_is_cut_off_says_so():
    with serving(says("half", finish="length")) as server:
        (choice,) = client_of(server).ask(PAYLOAD).body["choices"]
    assert choice["finish_reason"] == "length"


def test_a_server_that_answers_in_one_piece_is_heard_too():
    with serving(says("a", "b", whole=True)) as server:
        assert texts(client_of(server).ask(PAYLOAD)) == ["a", "b"]


def test_an_error_in_the_midst_of_an_answer_is_tried_again():
    text = 'data: {"error": {"message": "out of memory"}}\n\n'
    broken = fails(text=text, headers={"Content-Type": "text/event-stream"})
    garbage = fails(text="data: {\n\n", headers={"Content-Type": "text/event-stream"})
    with serving(broken, garbage, says("a")) as server:
        assert client_of(server).ask(PAYLOAD).retries == 2
    with serving(broken) as server, pytest.raises(EndpointError) as raised:
        client_of(server).ask(PAYLOAD)
    assert "breaks off (out of memory), 3 times in a row" in str(raised.value)


@pytest.mark.parametrize(
    "event",
    [
        "5",
        "[]",
        '"text"',
        '{"choices": 3}',
        '{"choices": ["a"]}',
        '{"choices": [{"delta": {"content": "a"}}]}',
        '{"choices": [{"index": null, "delta": {"content": "a"}}]}',
        '{"choices": [{"index": 0, "delta": {"content": 7}}]}',
        '{"choices": [{"index": 0, "delta": ["a"]}]}',
    ],
)
def test_events_that_are_no_part_of_an_answer_are_tried_again(event):
    text = f"data: {event}\n\ndata: [DONE]\n\n"
    odd = fails(text=text, headers={"Content-Type": "text/event-stream"})
    with serving(odd, says("a")) as server:
        reply = client_of(server).ask(PAYLOAD)
    assert (texts(reply), reply.retries) == (["a"], 1)


FORM = {"type": "json_schema", "json_schema": {"name": "x", "schema": {}}}


def refuses(*names):
    """A server that has not all that may be asked for."""

    def entry(payload):
        for name in names:
            if name in payload:
                return error(400, said=f"unknown field {name!r}")(payload)
        return says("a", whole="stream" in names)(payload)

    return entry


@pytest.mark.parametrize(
    "names",
    [
        (),
        ("response_format",),
        ("stream_options",),
        ("stream_options", "stream"),
        ("response_format", "stream_options", "stream"),
    ],
    ids=lambda names: " ".join(names) or "nothing",
)
def test_what_a_server_has_not_is_left_out_from_then_on(names):
    with serving(refuses(*names)) as server:
        client = Client(Endpoint(server.url, KEY), PATIENCE, response_format=FORM)
        replies = [client.ask(PAYLOAD) for _ in range(2)]
    assert [texts(reply) for reply in replies] == [["a"], ["a"]]
    assert [reply.retries for reply in replies] == [0, 0]
    assert [reply.structured for reply in replies] == [
        "response_format" not in names
    ] * 2
    assert len(server.payloads) == len(names) + 2
    everything = SENT | {"response_format": FORM}
    assert server.payloads[0] == everything
    left = {key: everything[key] for key in everything if key not in names}
    assert server.payloads[-2:] == [left, left]


def test_a_server_that_gives_one_candidate_per_request_is_asked_for_one():
    def entry(payload):
        if payload["n"] > 1:
            return error(400, said="Field 'n': must be between 1 <= value <= 1")(
                payload
            )
        return says("a")(payload)

    with serving(entry) as server:
        client = client_of(server)
        assert texts(client.ask(PAYLOAD)) == texts(client.ask(PAYLOAD)) == ["a"]
    assert [payload["n"] for payload in server.payloads] == [2, 1, 1]


def test_no_secret_is_shown():
    endpoint = Endpoint(f"https://user:{KEY}@host:1/v1?key={KEY}", KEY)
    assert str(endpoint) == "https://host:1/v1"
    assert KEY not in repr(Endpoint("https://host/v1", KEY))


def test_model_is_the_given_one_or_that_of_the_environment(monkeypatch):
    monkeypatch.setenv("MPMWORLDS_LLM_MODEL", "b")
    assert (model_name("a"), model_name(None)) == ("a", "b")
    monkeypatch.delenv("MPMWORLDS_LLM_MODEL")
    with pytest.raises(ValueError, match="give --model or set MPMWORLDS_LLM_MODEL"):
        model_name(None)
