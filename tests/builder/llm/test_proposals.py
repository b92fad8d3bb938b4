"""From requests to proposals, over a real connection to a server that misbehaves."""

import json
from contextlib import contextmanager
from itertools import islice

import pytest

from mpmworlds.builder.llm.client import STREAMED, Client, EndpointError
from mpmworlds.builder.llm.endpoint import Endpoint, Patience
from mpmworlds.builder.llm.proposals import Asker, Filter, propose, world
from mpmworlds.builder.llm.request import Sampling, child_requests, parent_requests
from mpmworlds.builder.llm.transcript import Transcript
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.scene import Scene
from tests.builder.llm.llm_server import (
    KEY,
    choice,
    completion,
    error,
    fails,
    fenced,
    new_scenes,
    says,
    serving,
    tiny_scene,
)

SEEDS = {f"s{i}": tiny_scene(50 + i) for i in range(4)}
PATIENCE = Patience(attempts=2, first_wait=0.01)


def everything(scene):
    return None


@contextmanager
def run_of(server, path, accept=everything, check=None, n=3, number=1, kind="parents"):
    """Proposals of a number of requests, and what filtered them."""
    make = {"parents": parent_requests, "children": child_requests}[kind]
    requests = islice(make(SEEDS, Sampling("m", 1, n)), number)
    with Transcript(path) as transcript:
        client = Client(Endpoint(server.url, KEY), PATIENCE)
        asker = Asker(client, transcript)
        chosen = Filter(accept, check or (lambda scene, text: []), asker.tally)
        chosen.know(SEEDS.values())
        yield propose(requests, asker, chosen), chosen


def result(server, path, **options):
    with run_of(server, path, **options) as (proposals, chosen):
        return list(proposals), chosen


def one_each(payload):
    """A server that ignores n."""
    return new_scenes(payload | {"n": 1})


def test_proposals_say_where_they_are_from(tmp_path):
    with serving(new_scenes) as server:
        proposals, chosen = result(server, tmp_path / "t", number=2)
    assert len(proposals) == 6
    assert len(server.payloads) == 2
    first = proposals[0]
    assert Scene.from_yaml(first.scene).to_yaml() == first.scene
    assert set(first.seeds) <= set(SEEDS)
    assert (first.parent, first.program) == ("", None)
    assert first.edit["operator"] == "llm"
    assert first.edit["model"] == "m"
    assert first.edit["request"].startswith("parents-00000-")
    assert [p.edit["choice"] for p in proposals] == [0, 1, 2, 0, 1, 2]
    assert chosen.tally.to_data() == {
        "requests": 2,
        "reused": 0,
        "retries": 0,
        "prompt_tokens": 200,
        "completion_tokens": 60,
        "accepted": 6,
        "rejected": {},
        "programs": {"absent": 6},
    }
    assert chosen.tally.price(3.0, 15.0) == pytest.approx((200 * 3 + 60 * 15) / 1e6)


def test_children_name_their_parent_and_edit(tmp_path):
    with serving(new_scenes) as server:
        proposals, _ = result(server, tmp_path / "t", kind="children", n=1)
    (child,) = proposals
    assert child.parent in SEEDS
    assert child.seeds == ()
    assert f"`{child.edit['edit']}`" in server.payloads[0]["messages"][1]["content"]


def test_server_that_ignores_n_is_asked_for_the_rest(tmp_path):
    with serving(one_each) as server:
        proposals, chosen = result(server, tmp_path / "t")
    assert [payload["n"] for payload in server.payloads] == [3, 2, 1]
    assert len({payload["seed"] for payload in server.payloads}) == 3
    assert len(proposals) == 3
    assert len({p.edit["request"] for p in proposals}) == 3
    assert chosen.tally.requests == 3


def test_choices_beyond_n_are_left_alone(tmp_path):
    texts = [fenced(tiny_scene(i)) for i in range(5)]
    with serving(says(*texts)) as server:
        proposals, _ = result(server, tmp_path / "t")
    assert (len(proposals), len(server.payloads)) == (3, 1)


def test_empty_choices_are_asked_again_a_bounded_number_of_times(tmp_path):
    with serving(fails(text=completion())) as server:
        proposals, chosen = result(server, tmp_path / "t")
    assert (proposals, len(server.payloads)) == ([], 3)
    assert chosen.tally.rejected == {"no_choices": 3}


def test_usage_that_the_server_leaves_out_counts_nothing(tmp_path):
    body = json.dumps({"choices": [choice("no")], "usage": {"prompt_tokens": "7"}})
    with serving(fails(text=body)) as server:
        _, chosen = result(server, tmp_path / "t", n=1)
    assert chosen.tally.prompt_tokens == chosen.tally.completion_tokens == 0


def test_every_candidate_is_accepted_or_counted_by_its_reason(tmp_path):
    new, seed = tiny_scene(1), SEEDS["s0"]
    renamed = Scene.from_yaml(new.to_yaml().replace("object_0", "thing"))
    replies = [
        choice(fenced(new)[:300], "length"),
        choice("I'm sorry, I cannot help with that."),
        choice("```yaml\nx: [\n```"),
        choice(fenced(new).replace("0.7]", "0.99]")),
        choice(fenced(seed)),
        choice(fenced(tiny_scene(2))),
        choice(fenced(new)),
        choice(fenced(renamed)),
        "nonsense",
    ]

    def accept(scene):
        return "static: nothing moves" if scene == tiny_scene(2) else None

    with serving(fails(text=completion(*replies))) as server:
        proposals, chosen = result(
            server, tmp_path / "t", accept=accept, n=len(replies)
        )
    assert [p.scene for p in proposals] == [new.to_yaml()]
    assert [(r.choice, r.reason) for r in chosen.rejected] == [
        (0, "truncated"),
        (1, "refused"),
        (2, "bad_yaml"),
        (3, "invalid_scene"),
        (4, "duplicate"),
        (5, "static"),
        (7, "duplicate"),
        (8, "malformed"),
    ]
    assert chosen.rejected[5].detail == "static: nothing moves"
    assert chosen.tally.rejected.total() + chosen.tally.accepted == len(replies)
    assert chosen.tally.rejected["duplicate"] == 2


def test_program_is_kept_only_if_it_agrees_and_the_scene_in_any_case(tmp_path):
    scenes = [tiny_scene(i) for i in range(4)]
    good, bad = link(scenes[0]), link(scenes[1])
    replies = [
        fenced(scenes[0], good),
        fenced(scenes[1], bad),
        fenced(scenes[2], good) + f"```python\n{bad}```",
        fenced(scenes[3]),
    ]

    def check(scene, program):
        return [] if program == good else ["it is red", "it is late"]

    with serving(says(*replies)) as server:
        proposals, chosen = result(server, tmp_path / "t", check=check, n=4)
    assert [p.program for p in proposals] == [good, None, None, None]
    assert [p.scene for p in proposals] == [scene.to_yaml() for scene in scenes]
    assert chosen.tally.programs == {
        "kept": 1,
        "disagrees": 1,
        "several": 1,
        "absent": 1,
    }
    assert [(r.reason, r.detail) for r in chosen.rejected] == [
        ("program", "it is red; it is late"),
        ("program", "2 programs, must be one"),
    ]


def test_rerun_gives_the_same_and_asks_nothing(tmp_path):
    with serving(one_each) as server:
        once, first = result(server, tmp_path / "t", number=2)
        asked = len(server.payloads)
        again, second = result(server, tmp_path / "t", number=2)
        assert len(server.payloads) == asked == 6
        more, _ = result(server, tmp_path / "t", number=3)
    assert again == once
    assert more[:6] == once
    assert len(server.payloads) == 9
    assert (first.tally.reused, second.tally.reused) == (0, 6)
    assert second.tally.to_data() == first.tally.to_data() | {"reused": 6}


def test_nothing_is_asked_ahead_of_what_is_taken(tmp_path):
    with serving(one_each) as server:
        with run_of(server, tmp_path / "t", number=5) as (proposals, _):
            next(proposals)
        assert len(server.payloads) == 1


def test_endpoint_that_fails_midway_loses_nothing(tmp_path):
    path = tmp_path / "t"
    with (
        serving(one_each, one_each, error(500)) as server,
        run_of(server, path) as (proposals, _),
    ):
        got = [next(proposals), next(proposals)]
        with pytest.raises(EndpointError) as raised:
            next(proposals)
    assert f"2 replies are kept in {path}; run the same command" in str(raised.value)
    with serving(one_each) as server:
        proposals, chosen = result(server, path)
    assert proposals[:2] == got
    assert len(proposals) == 3
    assert len(server.payloads) == 1
    assert chosen.tally.reused == 2


def test_retries_are_counted_also_by_a_rerun(tmp_path):
    with serving(error(500), one_each) as server:
        _, chosen = result(server, tmp_path / "t", n=1)
        assert chosen.tally.retries == 1
        _, chosen = result(server, tmp_path / "t", n=1)
        assert chosen.tally.retries == 1


def test_transcript_holds_requests_and_replies_but_no_key(tmp_path):
    with serving(one_each) as server:
        result(server, tmp_path / "t")
    text = (tmp_path / "t").read_text()
    assert KEY not in text
    lines = [json.loads(line) for line in text.splitlines()]
    sent = [line["request"] for line in lines]
    assert len(sent) == len(server.payloads)
    for request, payload in zip(sent, server.payloads, strict=True):
        assert payload == request | STREAMED
    assert [line["reply"] for line in lines] == [
        json.loads(one_each(payload).text) for payload in server.payloads
    ]


def test_worlds_differ_by_physics_only():
    scene = tiny_scene()
    data = scene.to_data()
    data["objects"] = data["objects"][::-1]
    data["objects"][0]["name"] = "other"
    data["objects"][1]["visualization"]["color"] = "#2C2DF5"
    data["simulation"]["seed"] = 99
    data["output"]["framerate"] = 10
    assert world(Scene.from_data(data)) == world(scene)
    assert world(tiny_scene(1)) != world(scene)
    data["environment"]["gravity"] = [0.0, -1.0]
    assert world(Scene.from_data(data)) != world(scene)
