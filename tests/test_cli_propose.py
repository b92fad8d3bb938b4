"""The verb `propose` against a server on this machine."""

import json
import os
import socket
import subprocess
import sys
import time

import pytest

from mpmworlds.builder.plan.manifest import read_table, recorded_manifest
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.scene import Scene
from tests.builder.llm.llm_server import (
    KEY,
    error,
    fails,
    fenced,
    new_scenes,
    says,
    serving,
    tiny_scene,
)


def one_each(payload):
    """A server that ignores n."""
    return new_scenes(payload | {"n": 1})


@pytest.fixture
def propose(command, tmp_path, monkeypatch):
    """Return a function: server or URL, options -> status, stdout, stderr."""

    def run(server, *options, kind="parents", count=2, screen="--no-screen"):
        monkeypatch.setenv("OPENAI_BASE_URL", getattr(server, "url", server))
        monkeypatch.setenv("OPENAI_API_KEY", KEY)
        monkeypatch.setenv("MPMWORLDS_LLM_MODEL", "env-model")
        where = ["--out", tmp_path / "p.jsonl"]
        options = [screen, *where, *options]
        return command("propose", "--kind", kind, "--count", count, *options)

    return run


def lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_proposals_are_written_and_the_costs_told(propose, tmp_path):
    with serving(one_each) as server:
        options = ["--json", "--price-in", 10, "--price-out", 100]
        status, out, err = propose(server, "--model", "given", *options)
        assert status == 0, err
        assert "propose: 100%" in err
        assert KEY not in out + err
        assert json.loads(out) == {
            "requests": 2,
            "reused": 0,
            "retries": 0,
            "prompt_tokens": 200,
            "completion_tokens": 20,
            "accepted": 2,
            "rejected": {},
            "programs": {"absent": 2},
            "price": 0.004,
        }
        before = (tmp_path / "p.jsonl").read_bytes()
        status, out, _ = propose(server, "--model", "given", "--json")
    assert (status, json.loads(out)["reused"]) == (0, 2)
    assert (tmp_path / "p.jsonl").read_bytes() == before
    assert [payload["model"] for payload in server.payloads] == ["given", "given"]
    assert [payload["n"] for payload in server.payloads] == [4, 3]
    rows = lines(tmp_path / "p.jsonl")
    assert [row["program"] for row in rows] == [None, None]
    assert [row["edit"]["model"] for row in rows] == ["given", "given"]
    assert all(Scene.from_yaml(row["scene"]) for row in rows)
    assert KEY not in (tmp_path / "p.transcript.jsonl").read_text()


def test_children_are_edits_of_the_given_scene(propose, tmp_path):
    scene = tmp_path / "mine.yaml"
    scene.write_text(tiny_scene().to_yaml())
    echo = says(fenced(tiny_scene()), fenced(tiny_scene(1)))
    with serving(echo) as server:
        options = ["--parent", scene, "--rejections", tmp_path / "r.jsonl"]
        status, out, _ = propose(server, *options, kind="children", count=1)
    assert status == 0
    assert "rejected: 1\n  duplicate: 1\n" in out
    (row,) = lines(tmp_path / "p.jsonl")
    assert (row["parent"], row["scene"]) == ("mine", tiny_scene(1).to_yaml())
    (rejected,) = lines(tmp_path / "r.jsonl")
    assert rejected["reason"] == "duplicate"


def test_children_of_roots_of_the_corpus_name_them(propose, tmp_path):
    echo = says(fenced(tiny_scene()), fenced(tiny_scene(1)))
    with serving(echo) as server:
        options = ["--parent", "p0003", "--parent", "s02"]
        status, *_ = propose(server, *options, kind="children", count=2)
        text = server.payloads[0]["messages"][1]["content"]
    assert status == 0
    assert {row["parent"] for row in lines(tmp_path / "p.jsonl")} <= {"p0003", "s02"}
    table = read_table(recorded_manifest("full"), ["id", "scene"]).to_pydict()
    texts = dict(zip(table["id"], table["scene"], strict=True))
    assert texts["p0003"] in text or texts["s02"] in text


def test_too_few_scenes_are_written_and_do_not_hold(propose, tmp_path):
    with serving(says(fenced(tiny_scene()))) as server:
        options = ["--n", 1, "--max-requests", 3]
        status, out, err = propose(server, *options)
    assert (status, len(server.payloads)) == (1, 3)
    assert "duplicate: 2" in out
    assert "1 of 2 scenes after 3 requests; raise --max-requests" in err
    assert len(lines(tmp_path / "p.jsonl")) == 1


def test_requests_to_a_server_that_ignores_n_are_counted_too(propose, tmp_path):
    with serving(one_each) as server:
        status, *_ = propose(server, "--max-requests", 2, count=5)
    assert (status, len(server.payloads)) == (1, 2)


def test_by_default_such_a_server_is_asked_for_ten_candidates_per_scene(propose):
    with serving(says(fenced(tiny_scene()), whole=True)) as server:
        status, out, _ = propose(server, count=2)
    assert (status, len(server.payloads)) == (1, 20)
    assert "duplicate: 19" in out


def test_an_endpoint_that_fails_leaves_what_is_there(propose, tmp_path):
    (tmp_path / "p.jsonl").write_text("of a good day\n")
    status, _, err = propose("http://127.0.0.1:9/v1", "--attempts", 1)
    assert (status, "cannot be reached" in err) == (2, True)
    assert (tmp_path / "p.jsonl").read_text() == "of a good day\n"


def test_programs_are_asked_for_and_checked(propose, tmp_path):
    scene, other = tiny_scene(), tiny_scene(1)
    color = scene.objects[0].visualization.color[1:]
    wrong = link(scene).replace(color, "FFFFFF")
    replies = fenced(scene, wrong), fenced(other, "def frames():\n  yield 1\n")
    with serving(says(*replies)) as server:
        options = ["--programs", "--rejections", tmp_path / "r.jsonl"]
        status, out, _ = propose(server, *options)
    assert (status, "programs: 2\n  disagrees: 2" in out) == (0, True)
    assert "```python" in server.payloads[0]["messages"][1]["content"]
    assert [row["program"] for row in lines(tmp_path / "p.jsonl")] == [None, None]
    first, second = lines(tmp_path / "r.jsonl")
    assert f"the first frame shows nothing in #{color}" in first["detail"]
    assert "the program ends in bad_frames before its first frame" in second["detail"]


@pytest.mark.slow
def test_program_that_agrees_is_kept(propose, tmp_path):
    program = link(tiny_scene())
    with serving(says(fenced(tiny_scene(), program))) as server:
        status, _, err = propose(server, "--programs", count=1)
    assert status == 0, err
    assert [row["program"] for row in lines(tmp_path / "p.jsonl")] == [program]


def test_unreachable_endpoint_is_one_line_that_says_what_to_set(propose, tmp_path):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{free.getsockname()[1]}/v1"
    status, out, err = propose(url, "--attempts", 1)
    assert (status, out) == (2, "")
    last = err.splitlines()[-1]
    assert last.startswith(f"mpmworlds propose: {url}: cannot be reached (")
    assert "set OPENAI_BASE_URL" in last
    assert f"0 replies are kept in {tmp_path / 'p.transcript.jsonl'}" in last


def test_failure_midway_keeps_the_scenes_before_it(propose, tmp_path):
    with serving(one_each, error(401)) as server:
        status, _, err = propose(server)
    assert status == 2
    assert "set OPENAI_API_KEY" in err
    assert len(lines(tmp_path / "p.jsonl")) == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--count", "0"], "--count 0: must be at least 1"),
        (["--n", "0"], "n = 0, must be at least 1"),
        (["--max-requests", "0"], "--max-requests 0: must be at least 1"),
        (["--attempts", "0"], "attempts = 0, must be at least 1"),
        (["--timeout", "0"], "timeout = 0.0 s, must be more than 0"),
        (["--requests-per-minute", "0"], "requests per minute = 0.0, must be more"),
        (["--price-in", "1"], "--price-in and --price-out: give both or none"),
        (["--parent", "x.yaml"], "--parent: only with --kind children"),
        (["--kind", "children", "--parent", "absent"], "absent"),
        (["--kind", "children", "--parent", "p9999"], "--parent p9999: is not in"),
        (["--kind", "children", "--manifest", "m"], "--manifest: only with --parent"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_use_is_told_before_anything_is_asked(
    options, message, propose, tmp_path
):
    with serving(one_each) as server:
        status, out, err = propose(server, *options)
    assert (status, out, server.payloads) == (2, "", [])
    assert message in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_no_request_is_answered_twice_after_kill_9(tmp_path):
    out, transcript = tmp_path / "p.jsonl", tmp_path / "t.jsonl"
    arguments = [
        *(sys.executable, "-m", "mpmworlds", "propose", "--model", "m"),
        *("--kind", "parents", "--count", "6", "--n", "2"),
        *("--out", out, "--transcript", transcript),
    ]
    never = fails(wait=60.0)
    with serving(one_each, one_each, one_each, never, one_each) as server:
        env = os.environ | {"OPENAI_BASE_URL": server.url, "OPENAI_API_KEY": KEY}
        with subprocess.Popen(
            arguments, env=env, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
        ) as running:
            deadline = time.monotonic() + 60
            while len(server.payloads) < 4 and time.monotonic() < deadline:
                time.sleep(0.02)
            running.kill()
        assert running.returncode == -9
        assert len(transcript.read_text().splitlines()) == 3
        with transcript.open("a") as file:
            file.write('{"key": "torn')
        subprocess.run(arguments, env=env, check=True, capture_output=True)
    before, after = server.payloads[:4], server.payloads[4:]
    assert after[0] == before[3], "the request without an answer comes first"
    asked = [json.dumps(payload) for payload in before[:3] + after]
    assert len(set(asked)) == len(asked) == 6
    assert len(lines(out)) == len(lines(transcript)) == 6
