"""A loopback server that speaks /v1/chat/completions, and misbehaves on demand.

It follows a script: one entry for each request that arrives, and the last one for all
further requests. An entry takes the request's payload to an `Act`.
"""

import json
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import zip_longest

from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, OBSTACLE, scene_data

KEY = "sk-secret-0123456789"
PROMPT_TOKENS, COMPLETION_TOKENS = 100, 10  # per request, and per choice


@dataclass(frozen=True)
class Act:
    """An answer: wait [s], then drop the connection or send status, headers, text.

    A completion is streamed if that is asked for, unless it is to come `whole`, with a
    `pause` [s] between its pieces, of which only the first so many are sent.
    """

    text: str = ""
    status: int = 200
    headers: dict = field(default_factory=dict)
    wait: float = 0.0
    drop: bool = False
    whole: bool = False
    pause: float = 0.0
    pieces: int | None = None


def fails(**act):
    """An entry that ignores the payload."""
    return lambda payload: Act(**act)


def error(status, headers=None, code=None, said=None):
    message = said or f"status {status}"
    text = json.dumps({"error": {"message": message, "code": code}})
    return fails(text=text, status=status, headers=headers or {})


def choice(text, finish="stop"):
    return {
        "index": 0,
        "finish_reason": finish,
        "message": {"role": "assistant", "content": text},
    }


def completion(*choices):
    usage = {
        "prompt_tokens": PROMPT_TOKENS,
        "completion_tokens": COMPLETION_TOKENS * len(choices),
    }
    return json.dumps({"id": "x", "choices": list(choices), "usage": usage})


def says(*texts, finish="stop", **act):
    """An entry that answers with these choices, whatever n was asked for."""
    return fails(text=completion(*(choice(text, finish) for text in texts)), **act)


def events(body, usage):
    """Events of a completion: pieces of all choices by turns, the last one first."""
    pieces = []
    for index, chosen in reversed(list(enumerate(body["choices"]))):
        text = chosen["message"].get("content") or ""
        cuts = [text[i : i + 40] for i in range(0, len(text), 40)]
        deltas = [{"role": "assistant"}, *({"content": cut} for cut in cuts)]
        told = [{"index": index, "delta": delta} for delta in deltas]
        told.append(
            {"index": index, "delta": {}, "finish_reason": chosen["finish_reason"]}
        )
        pieces.append(told)
    turns = [piece for turn in zip_longest(*pieces) for piece in turn if piece]
    chunks = [{"id": body["id"], "choices": [piece]} for piece in turns]
    if usage:
        chunks.append({"id": body["id"], "choices": [], "usage": body["usage"]})
    return [f"data: {json.dumps(chunk)}\n\n" for chunk in chunks] + ["data: [DONE]\n\n"]


def tiny_scene(number=0):
    """A valid scene of 32 cells and 64 pixels; every number gives another one."""
    shape = BODY["shape"] | {"center": [0.3 + 0.003 * number, 0.7]}
    return Scene.from_data(scene_data(BODY | {"shape": shape}, OBSTACLE))


def fenced(scene, program=None):
    """The reply of a model that keeps to the rules."""
    text = f"Here it is.\n```yaml\n{scene.to_yaml()}```\n"
    return text if program is None else f"{text}```python\n{program}```\n"


def new_scenes(payload):
    """An entry that answers with n scenes that depend on the request's seed only."""
    first = payload["seed"] % 100_000
    texts = [
        fenced(tiny_scene((first + 7919 * i) % 100_000 / 1000))
        for i in range(payload["n"])
    ]
    return Act(text=completion(*map(choice, texts)))


def is_completion(act):
    """Whether a server that is not broken would send this, so that it has pieces."""
    if act.status != 200 or not act.text.startswith('{"id": "x", "choices"'):
        return False
    choices = json.loads(act.text)["choices"]
    whole = [chosen for chosen in choices if isinstance(chosen, dict)]
    sound = [chosen for chosen in whole if isinstance(chosen.get("message"), dict)]
    return len(sound) == len(choices)


class Server:
    """What a test sees of a running server."""

    def __init__(self, script):
        self.script = script
        self.payloads = []
        self.times = []
        self.keys = set()
        self.url = ""
        self._lock = threading.Lock()

    def act(self, payload, authorization):
        with self._lock:
            number = len(self.payloads)
            self.payloads.append(payload)
            self.times.append(time.monotonic())
            self.keys.add(authorization)
        return self.script[min(number, len(self.script) - 1)](payload)


@contextmanager
def serving(*script):
    """Run a server that follows a script, on a free port."""
    server = Server(script)

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self):
            payload = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            act = server.act(payload, self.headers["Authorization"])
            time.sleep(act.wait)
            if act.drop:
                self.close_connection = True
                return
            body = act.text.encode()
            headers = {"Content-Type": "application/json"} | act.headers
            try:
                if payload.get("stream") and not act.whole and is_completion(act):
                    self.stream(act, payload)
                    return
                self.send_response(act.status)
                for name, value in headers.items():
                    self.send_header(name, value)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)
            except (BrokenPipeError, ConnectionResetError):
                self.close_connection = True  # the client has given up

        def stream(self, act, payload):
            self.send_response(act.status)
            self.send_header("Content-Type", "text/event-stream; charset=utf-8")
            self.end_headers()  # the end of the connection is that of the answer
            self.close_connection = True
            usage = payload.get("stream_options", {}).get("include_usage")
            for event in events(json.loads(act.text), usage)[: act.pieces]:
                time.sleep(act.pause)
                self.wfile.write(event.encode())
                self.wfile.flush()

        def log_message(self, *arguments):
            pass

    class Quiet(ThreadingHTTPServer):
        daemon_threads = True
        block_on_close = False

    with Quiet(("127.0.0.1", 0), Handler) as http:
        server.url = f"http://127.0.0.1:{http.server_port}/v1"
        thread = threading.Thread(target=http.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            http.shutdown()
            thread.join()
