"""A served model: asked until it has said enough, and never twice."""

import base64
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from mpmworlds.baselines.learned.extras import MissingExtraError
from mpmworlds.baselines.protocol import (
    Failure,
    InfrastructureError,
    ProgramText,
    SceneText,
)
from mpmworlds.baselines.results import read_results
from mpmworlds.baselines.scoring import task_of
from mpmworlds.baselines.served.predictor import ServedWriter
from mpmworlds.baselines.served.usage import usage_of
from mpmworlds.loaders.load import load
from tests.builder.llm.llm_server import (
    COMPLETION_TOKENS,
    KEY,
    PROMPT_TOKENS,
    Act,
    choice,
    completion,
    error,
    fails,
    says,
    serving,
    tiny_scene,
)

pytest.importorskip("openai", reason="needs mpmworlds[served]")

SAMPLES = ("p0002", "p0002-n00")  # those of test
PROGRAM = "def frames():\n    yield {}\n"


def program(number):
    return PROGRAM.format(number)


def fenced(text, language="python"):
    return f"Here it is.\n```{language}\n{text}```\n"


def numbered(payload):
    """As many programs as were asked for, of numbers that follow from the seed."""
    texts = [fenced(program(payload["seed"] + k)) for k in range(payload["n"])]
    return Act(text=completion(*map(choice, texts)))


def one_at_a_time(payload):
    return Act(text=completion(choice(fenced(program(payload["seed"])))))


@pytest.fixture
def asking(monkeypatch, tmp_path):
    """Return a maker of predictors that ask a server."""

    def make(server, **options):
        monkeypatch.setenv("OPENAI_BASE_URL", server.url)
        monkeypatch.setenv("OPENAI_API_KEY", KEY)
        folder = str(tmp_path / "transcripts")
        given = {"model": "m", "n": 5, "transcripts": folder, "pictures": 2}
        return ServedWriter(**given | options)

    return make


@pytest.fixture(autouse=True)
def no_waiting(monkeypatch):
    """Waits between attempts take no time."""
    clock = SimpleNamespace(
        sleep=lambda _: None, monotonic=time.monotonic, time=time.time
    )
    monkeypatch.setattr("mpmworlds.builder.llm.client.time", clock)


@pytest.fixture
def task(release):
    return task_of(load(release, "test", "mini")[0])


def test_a_model_is_shown_the_prefix_and_told_what_is_wanted(asking, task):
    with serving(numbered) as server:
        found = asking(server, temperature=0.5, max_tokens=99, seed=3).predict(task)
    (payload,) = server.payloads
    first = payload["seed"]
    assert found == [ProgramText(program(first + k)) for k in range(5)]
    assert (payload["model"], payload["n"]) == ("m", 5)
    assert (payload["temperature"], payload["max_tokens"]) == (0.5, 99)
    assert "top_p" not in payload, "the server's own"
    assert payload["stream"]
    _, user = payload["messages"]
    urls = [p["image_url"]["url"] for p in user["content"] if p["type"] == "image_url"]
    pngs = [
        base64.b64decode(url.removeprefix("data:image/png;base64,")) for url in urls
    ]
    shown = [cv2.imdecode(np.frombuffer(png, np.uint8), -1)[..., ::-1] for png in pngs]
    np.testing.assert_array_equal(shown, task.prefix[[0, -1]])


def test_a_model_that_sees_nothing_is_sent_texts_alone(asking, task):
    with serving(numbered) as server:
        asking(server, pictures=0).predict(task)
    kinds = {p["type"] for m in server.payloads[0]["messages"] for p in m["content"]}
    assert kinds == {"text"}


def test_a_server_that_gives_one_at_a_time_is_asked_until_there_are_enough(
    asking, task
):
    with serving(one_at_a_time) as server:
        found = asking(server).predict(task)
    assert len(server.payloads) == 5
    assert [payload["n"] for payload in server.payloads] == [5, 4, 3, 2, 1]
    assert len(set(found)) == 5, "each is asked with a seed of its own"


def test_what_was_answered_is_not_asked_again(asking, task):
    other = replace(task, id="f" * 16)
    with serving(numbered) as server:
        first = asking(server).predict(task)
        assert asking(server).predict(task) == first
        assert len(server.payloads) == 1
        assert asking(server).predict(other) != first
        asking(server, seed=1).predict(task)
        asking(server).predict(replace(task, regime="caption", side_info="Sand."))
    assert len(server.payloads) == 4


def test_half_an_answer_is_gone_on_with(asking, task):
    with serving(one_at_a_time, one_at_a_time, error(500)) as server:
        with pytest.raises(InfrastructureError, match="500"):
            asking(server, attempts=2).predict(task)
        asked = len(server.payloads)
        server.script = [one_at_a_time]
        assert len(asking(server).predict(task)) == 5
    assert asked == 4
    assert len(server.payloads) == asked + 3


@pytest.mark.parametrize(
    ("trouble", "told"),
    [
        (error(500), "status 500"),
        (error(429), "429"),
        (error(401), "set OPENAI_API_KEY"),
        (fails(drop=True), "cannot be reached|breaks off"),
        (fails(text="<html>"), "no chat completion"),
        (says(fenced(program(1)), pieces=2), "breaks off"),
    ],
    ids=["500", "429", "401", "dropped", "no JSON", "half"],
)
def test_trouble_is_nobody_s_failure(asking, task, trouble, told):
    with serving(trouble) as server, pytest.raises(InfrastructureError, match=told):
        asking(server, attempts=2).predict(task)


def test_trouble_that_passes_is_nothing(asking, task):
    with serving(error(429), fails(drop=True), numbered) as server:
        assert len(asking(server).predict(task)) == 5
    assert len(server.payloads) == 3


@pytest.mark.parametrize(
    ("answer", "outcome"),
    [
        (says(*["```python\nx = 1"] * 5, finish="length"), "truncated"),
        (says(*["The ball falls."] * 5), "no_program"),
        (says(*["I cannot do that."] * 5), "refused"),
        (says(*[""] * 5), "empty"),
    ],
    ids=["truncated", "no program", "refused", "empty"],
)
def test_what_is_no_program_is_the_model_s_failure(asking, task, answer, outcome):
    with serving(answer) as server:
        found = asking(server).predict(task)
    assert {type(one) for one in found} == {Failure}
    assert [one.outcome for one in found] == [outcome] * 5


def test_candidates_that_a_server_owes_are_counted(asking, task):
    with serving(numbered, says()) as server:
        asked = asking(server, n=2)
        server.script = [says(fenced(program(1))), says()]
        found = asked.predict(task)
    assert found[0] == ProgramText(program(1))
    assert found[1].outcome == "no_choice"
    assert found[1].reason == "the server gave 1 of 2 candidates"


def test_a_scene_is_asked_for_by_its_schema(asking, task):
    scene = tiny_scene().to_yaml()
    with serving(says(*[fenced(scene, "yaml")] * 5)) as server:
        asked = asking(server, task="scene", structured=True)
        assert asked.predict(task) == [SceneText(scene)] * 5
    (payload,) = server.payloads
    assert payload["response_format"]["type"] == "json_schema"
    assert "```json" in payload["messages"][0]["content"][0]["text"]


def test_usage_is_counted_over_transcripts(asking, task, tmp_path):
    with serving(error(500), numbered, says("x", finish="length")) as server:
        asking(server).predict(task)
        asking(server, n=1).predict(replace(task, id="f" * 16))
    usage = usage_of(tmp_path / "transcripts")
    assert (usage.requests, usage.retries) == (2, 1)
    assert usage.prompt_tokens == 2 * PROMPT_TOKENS
    assert usage.completion_tokens == 6 * COMPLETION_TOKENS
    assert usage.models == {"m": 2}
    assert usage.endings == {"stop": 5, "length": 1}


def test_what_decides_the_answers_is_told_and_the_key_is_not(asking, task, tmp_path):
    with serving(numbered) as server:
        asked = asking(server, timeout=9.0)
        asked.predict(task)
        told = asked.configuration
        assert told["model"] == "m" and told["server"] == server.url
        assert told == asking(server, timeout=5.0).configuration
        assert told != asking(server, temperature=0.1).configuration
    kept = [path.read_text() for path in tmp_path.rglob("*.jsonl")]
    assert kept and KEY not in json.dumps([kept, dict(told)])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"n": 0}, "n = 0, must be at least 1"),
        ({"pictures": 1}, "pictures = 1"),
        ({"structured": True}, "only scenes have a schema"),
    ],
)
def test_impossible_options_are_refused(options, told):
    with pytest.raises(ValueError, match=told):
        ServedWriter("m", **options)


def test_a_model_that_nobody_named_is_told_before_anything_is_asked(monkeypatch):
    monkeypatch.delenv("MPMWORLDS_LLM_MODEL", raising=False)
    with pytest.raises(ValueError, match="no model is named"):
        _ = ServedWriter().configuration


def test_a_missing_package_is_told_with_the_command(monkeypatch):
    monkeypatch.setattr(
        "mpmworlds.baselines.learned.extras.find_spec",
        lambda name: None if name == "openai" else name,
    )
    with pytest.raises(MissingExtraError, match=r"pip install 'mpmworlds\[served\]'"):
        ServedWriter("m")


def test_an_evaluation_that_is_killed_asks_only_what_is_missing(
    release, corpus, tmp_path
):
    true = fenced(corpus.programs["p0002"])
    slow = says(true, true, true, wait=0.0)
    stuck = fails(wait=60.0)
    arguments = [
        *(sys.executable, "-m", "mpmworlds", "evaluate", "--predictor", "served"),
        *("--release", release, "--out", tmp_path / "out", "--workers", "1"),
        *("--predictor-option", "model=m", "--predictor-option", "n=3"),
        *("--predictor-option", f"transcripts={tmp_path / 'transcripts'}"),
    ]
    with serving(slow, stuck) as server:
        place = {"OPENAI_BASE_URL": server.url, "OPENAI_API_KEY": "x"}
        environment = os.environ | place
        with subprocess.Popen(arguments, env=environment) as process:
            while len(server.payloads) < 2 and process.poll() is None:
                time.sleep(0.05)
            process.send_signal(signal.SIGKILL)
        assert len(server.payloads) == 2
        server.script = [says(fenced("def frames():\n    yield 1 / 0\n"))]
        subprocess.run(arguments, env=environment, check=True, timeout=120)
    assert len(server.payloads) == 2 + 3, "of the second sample, one at a time"
    _, results = read_results(tmp_path / "out" / "results.jsonl")
    first, second = ([r for r in results if r.sample_id == s] for s in SAMPLES)
    scores = [r.continuation["mask_iou"] for r in first if r.continuation]
    assert max(scores) == 1.0
    assert {r.outcome for r in second} == {"exception"}
