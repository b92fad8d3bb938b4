"""Parents that a language model proposed, as a batch of a plan."""

import dataclasses
import json

import pytest

from mpmworlds.builder.candidates import NoCandidateError
from mpmworlds.builder.plan import write_plan
from mpmworlds.builder.profile import Batch, Count, PlanError
from mpmworlds.sim.scene import Scene
from tests.builder.plans import SMALL
from tests.sim.scenes import BODY, FAN, scene_data

PROFILE = dataclasses.replace(
    SMALL, seeds=(), parents=(Batch(1, 35),), child_perturbations=Count(0)
)


@pytest.fixture
def proposals(tmp_path):
    """A file of two proposals."""
    path = tmp_path / "proposals.jsonl"
    scenes = [
        Scene.from_data(scene_data(*things, gravity=(g, -9.0)))
        for g, things in ((0.0, ()), (3.0, (BODY, FAN)))
    ]
    rows = [
        {
            "seeds": ["s00_dam_break_pegs", "s04_bouncing_blocks"],
            "parent": "",
            "edit": {"operator": "llm", "model": "m", "request": "k", "choice": n},
            "scene": scene.to_yaml(),
            "program": None,
        }
        for n, scene in enumerate(scenes)
    ]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return path


def test_proposals_become_parents_with_descendants(proposals, tmp_path):
    batches = (*PROFILE.parents, Batch(2, proposals=str(proposals)))
    profile = dataclasses.replace(PROFILE, parents=batches)
    rows = {row.id: row for row in write_plan(profile, tmp_path / "m.parquet").rows}
    before = write_plan(PROFILE, tmp_path / "before.parquet").rows
    assert {row.id: rows[row.id] for row in before} == {r.id: r for r in before}
    for n in (0, 1):
        row = rows[f"p000{n + 1}"]
        assert (row.kind, row.parent_id) == ("parent", "")
        assert row.seeds == ("s00_dam_break_pegs", "s04_bouncing_blocks")
        assert json.loads(row.edit) == {
            "operator": "llm",
            "model": "m",
            "request": "k",
            "choice": n,
        }
        assert Scene.from_yaml(row.scene).environment.gravity == ((0.0, 3.0)[n], -9.0)
        assert (
            rows[f"{row.id}-c0"].parent_id == rows[f"{row.id}-n00"].parent_id == row.id
        )


@pytest.mark.parametrize(
    ("text", "count", "message"),
    [
        (None, 1, "No such file"),
        ("not json\n", 1, "Expecting value"),
        ('{"seeds": [], "edit": {}, "scene": ""}\n', 2, "has 1, must have at least"),
        ('{"seeds": []}\n', 1, "have no 'edit'"),
    ],
)
def test_a_file_that_gives_no_parents_is_named(text, count, message, tmp_path):
    path = tmp_path / "p.jsonl"
    if text is not None:
        path.write_text(text)
    profile = dataclasses.replace(PROFILE, parents=(Batch(count, proposals=str(path)),))
    with pytest.raises(PlanError, match=r"p\.jsonl") as error:
        write_plan(profile, tmp_path / "m.parquet")
    assert message in str(error.value)


def test_a_proposal_that_repeats_another_is_named(proposals, tmp_path):
    proposals.write_text(2 * proposals.read_text().splitlines(keepends=True)[0])
    batch = Batch(2, proposals=str(proposals))
    profile = dataclasses.replace(PROFILE, parents=(batch,))
    with pytest.raises(NoCandidateError, match=r"p0001: proposal 1 of .* is rejected"):
        write_plan(profile, tmp_path / "m.parquet")
