"""The k-th request of a run is always the same, and shows what it should."""

import json
from hashlib import sha256
from importlib.resources import files
from itertools import islice

import pytest

from mpmworlds.builder.llm.prompts import wording
from mpmworlds.builder.llm.request import (
    Sampling,
    child_requests,
    parent_requests,
    top_up,
)
from mpmworlds.builder.llm.schema_text import schema_text
from mpmworlds.builder.recipes.colors import LEAST_LUMA
from mpmworlds.builder.recipes.modify import EDITS
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.palette import PALETTE, luma
from mpmworlds.sim.scene.scene import json_schema

WORDING_SHA256 = "9c05bdf95d540911912eea1e480f575ffe5f7f74118a01ce728a98f9d5fd1a8e"
SEEDS = dict(list(load_seeds().items())[:6])
HOW = Sampling("m", root_seed=1, n=3)
ASK = {"parents": parent_requests, "children": child_requests}


def first(kind, number, how=HOW, scenes=SEEDS):
    return list(islice(ASK[kind](scenes, how), number))


def content(request):
    return "\n".join(message["content"] for message in request.payload["messages"])


@pytest.mark.parametrize("kind", ASK)
def test_requests_are_the_same_whenever_they_are_asked(kind):
    once = first(kind, 12)
    assert first(kind, 4) == once[:4]
    assert first(kind, 12, scenes=dict(reversed(SEEDS.items()))) == once
    assert len({request.key for request in once}) == 12
    assert len({request.payload["seed"] for request in once}) == 12
    assert json.loads(json.dumps(once[0].payload)) == once[0].payload


@pytest.mark.parametrize("kind", ASK)
@pytest.mark.parametrize(
    "how",
    [
        Sampling("other", 1, 3),
        Sampling("m", 2, 3),
        Sampling("m", 1, 4),
        Sampling("m", 1, 3, programs=True),
        Sampling("m", 1, 3, temperature=0.5),
        Sampling("m", 1, 3, max_tokens=100),
    ],
    ids=["model", "root seed", "n", "programs", "temperature", "max_tokens"],
)
def test_whatever_is_asked_otherwise_has_another_key(kind, how):
    keys = {request.key for request in first(kind, 3)}
    assert keys.isdisjoint(request.key for request in first(kind, 3, how))


def test_only_given_settings_are_sent():
    assert first("parents", 1)[0].payload.keys() == {"messages", "seed", "model", "n"}
    how = Sampling("m", 1, 2, temperature=0.5, max_tokens=9)
    payload = first("parents", 1, how)[0].payload
    assert (payload["temperature"], payload["max_tokens"]) == (0.5, 9)
    assert (payload["model"], payload["n"]) == ("m", 2)


def test_parents_show_two_or_three_seeds_the_schema_and_the_palette():
    requests = first("parents", 20)
    assert {len(request.seeds) for request in requests} == {2, 3}
    assert {name for request in requests for name in request.seeds} == set(SEEDS)
    for request in requests[:4]:
        text = content(request)
        shown = {name for name, scene in SEEDS.items() if scene.to_yaml() in text}
        assert shown == set(request.seeds)
        assert link(SEEDS[request.seeds[0]]) not in text
        assert wording("v1").schema in text
        bright = [c for c in PALETTE.values() if luma(c) >= LEAST_LUMA]
        assert all(color in text for color in bright)
        assert request.parent == request.edit == ""


def test_programs_are_shown_and_asked_for_on_demand():
    how = Sampling("m", 1, programs=True)
    for kind in ASK:
        request = first(kind, 1, how)[0]
        for name in request.seeds or [request.parent]:
            assert link(SEEDS[name]) in content(request)
        assert "```python" in request.payload["messages"][1]["content"][-700:]


def test_children_show_one_parent_and_one_edit():
    requests = first("children", 40)
    assert {request.parent for request in requests} == set(SEEDS)
    assert {request.edit for request in requests} == set(EDITS)
    for request in requests[:6]:
        text = content(request)
        assert SEEDS[request.parent].to_yaml() in text
        assert f"`{request.edit}`" in text
        assert EDITS[request.edit].__doc__.splitlines()[0] in text
        assert request.seeds == ()


def test_the_schema_in_few_words_has_every_key_and_limit():
    text = schema_text()
    schema = json_schema()
    parts = [schema, *schema["$defs"].values()]
    keys = {key for part in parts for key in part.get("properties", {})}
    assert not {key for key in keys if f"{key}: " not in text}
    assert "radius: > 0 and <= 0.5; radius [m]" in text
    assert "contact: separate | slip | sticky (default separate); contact law" in text
    assert "physics_properties: material; elastic, liquid, plastic," in text
    assert text.count("constitutive_model: liquid") == 1


def test_the_wording_of_a_version_never_changes():
    text = files("mpmworlds.builder.llm").joinpath("wording/v1.yaml").read_bytes()
    assert sha256(text).hexdigest() == WORDING_SHA256
    with pytest.raises(ValueError, match="wording = 'v9', must be one of v1"):
        wording("v9")


def test_an_edit_that_is_added_changes_no_request(monkeypatch):
    before = first("children", 6)
    monkeypatch.setitem(EDITS, "aaa", lambda means, scene: {})
    assert first("children", 6) == before
    assert wording("v1").edits.keys() <= EDITS.keys()


def test_top_up_asks_the_same_with_another_seed():
    request = first("parents", 1)[0]
    assert top_up(request, 0, 3) == request
    one, other = top_up(request, 1, 2), top_up(request, 2, 1)
    assert one == top_up(request, 1, 2)
    assert (one.payload["n"], other.payload["n"]) == (2, 1)
    assert len({r.key for r in (request, one, other)}) == 3
    assert len({r.payload["seed"] for r in (request, one, other)}) == 3
    assert one.payload["messages"] == request.payload["messages"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Sampling("m", 1, n=0), "n = 0, must be at least 1"),
        (lambda: first("parents", 1, scenes={"a": 1}), "1 seeds to show, must be at"),
        (lambda: first("children", 1, scenes={}), "give at least one parent"),
    ],
    ids=["n", "seeds", "parents"],
)
def test_impossible_request_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
