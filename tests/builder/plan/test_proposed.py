"""Parents and children that a language model proposed, as part of a plan."""

import dataclasses
import json
import pickle

import pytest

from mpmworlds.builder.plan.candidates import NoCandidateError
from mpmworlds.builder.plan.plan import write_plan
from mpmworlds.builder.plan.profile import Batch, Count, PlanError, Profile, sample_ids
from mpmworlds.builder.plan.proposed import ProposalError, read_proposals
from mpmworlds.sim.scene.scene import Scene
from tests.builder.plan.plans import SMALL
from tests.sim.scenes import BODY, FAN, scene_data

SEEDS = ["s00_dam_break_pegs", "s04_bouncing_blocks"]
PROFILE = dataclasses.replace(SMALL, seeds=("s02",), parents=(Batch(1, 35),))
SCENES = [
    Scene.from_data(scene_data(*things, gravity=(g, -9.0)))
    for g, things in ((0.0, ()), (3.0, (BODY, FAN)), (1.0, (BODY,)))
]


def line(number, parent=""):
    """What `mpmworlds propose` writes for a scene."""
    edit = {"operator": "llm", "model": "m", "request": "k", "choice": number}
    return {"seeds": SEEDS, "parent": parent, "edit": edit, "program": None} | {
        "scene": SCENES[number].to_yaml()
    }


@pytest.fixture
def write(tmp_path):
    """Return a function: lines -> file of proposals."""

    def write(*lines):
        path = tmp_path / "proposals.jsonl"
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))
        return path

    return write


@pytest.fixture
def plan(tmp_path):
    """Return a function: profile -> rows of its plan by id."""

    def plan(profile):
        rows = write_plan(profile, tmp_path / "manifest.parquet", workers=1).rows
        return {row.id: row for row in rows}

    return plan


def test_proposals_become_parents_with_descendants(write, plan):
    batch = Batch(2, proposals=read_proposals(write(line(0), line(1)), 2))
    rows = plan(dataclasses.replace(PROFILE, parents=(*PROFILE.parents, batch)))
    before = plan(PROFILE)
    assert {sample: rows[sample] for sample in before} == before
    for n in (0, 1):
        row = rows[f"p000{n + 1}"]
        assert (row.kind, row.parent_id, row.seeds) == ("parent", "", tuple(SEEDS))
        assert json.loads(row.edit) == line(n)["edit"]
        assert Scene.from_yaml(row.scene).environment.gravity == ((0.0, 3.0)[n], -9.0)
        assert (
            rows[f"{row.id}-c0"].parent_id == rows[f"{row.id}-n00"].parent_id == row.id
        )


def test_proposals_become_children_with_perturbations_beside_the_drawn_ones(
    write, plan
):
    lines = line(0, "p0000"), line(1, "s02_jet_on_fan"), line(2, "p0000")
    proposed = read_proposals(write(*lines))
    profile = dataclasses.replace(PROFILE, proposed_children=proposed)
    rows, before = plan(profile), plan(PROFILE)
    assert sorted(rows) == sample_ids(profile)
    assert {sample: rows[sample] for sample in before} == before
    assert sorted(rows.keys() - before.keys()) == [
        *("p0000-c500", "p0000-c500-n00", "p0000-c501", "p0000-c501-n00"),
        *("s02-c500", "s02-c500-n00"),
    ]
    for sample, number in (("p0000-c500", 0), ("s02-c500", 1), ("p0000-c501", 2)):
        row, root = rows[sample], sample.partition("-")[0]
        assert (row.kind, row.parent_id, row.family_id) == ("child", root, root)
        assert row.seeds == rows[root].seeds
        assert json.loads(row.edit) == line(number)["edit"]
        gravity = Scene.from_yaml(row.scene).environment.gravity
        assert gravity == SCENES[number].environment.gravity
        assert rows[f"{sample}-n00"].parent_id == sample
    more = plan(dataclasses.replace(profile, children=(Count(2),)))
    assert {sample: more[sample] for sample in rows} == rows


def test_a_profile_names_the_files_and_carries_what_they_hold(write):
    path = write(line(0, "p0000"), line(1, "p0001"))
    split = {"salt": "s", "test_fraction": 0.4, "modification_fraction": 0.5}
    counts = dict.fromkeys(("children", "root_perturbations", "child_perturbations"), 1)
    sizes = {"grid_resolution": 64, "resolution": 64, "duration_frames": 5}
    fields = {"seeds": [], "screen": "none", "split": split} | counts | sizes
    fields["parents"] = [
        {"count": 1, "seeds": 35},
        {"count": 1, "proposals": str(path)},
    ]
    fields["proposed_children"] = str(path)
    profile = Profile.from_params({"root_seed": 1, "profiles": {"x": fields}}, "x")
    path.unlink()  # as on a machine of a cluster that has not got the file
    profile = pickle.loads(pickle.dumps(profile))
    (first,), both = profile.parents[1].proposals, profile.proposed_children
    assert (first, both[0].source) == (both[0], f"{path}:1")
    assert [proposal.scene for proposal in both] == [s.to_yaml() for s in SCENES[:2]]
    assert "p0001-c500-n00" in sample_ids(profile)


@pytest.mark.parametrize(
    ("text", "count", "message"),
    [
        (None, 1, "No such file"),
        ("not json\n", 1, "Expecting value"),
        (json.dumps(line(0)), 2, "has 1, must have at least count = 2; lower it or"),
        ('{"seeds": [], "parent": ""}\n', None, "p.jsonl:1: has no 'edit'"),
        ("[]\n", 1, "p.jsonl:1: has no 'seeds'"),
    ],
    ids=["absent", "no JSON", "too few", "without an edit", "no object"],
)
def test_a_file_that_gives_no_proposals_is_named(text, count, message, tmp_path):
    path = tmp_path / "p.jsonl"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ProposalError, match=r"p\.jsonl") as error:
        read_proposals(path, count)
    assert message in str(error.value)


def test_a_child_of_no_root_is_named(write):
    proposed = read_proposals(write(line(0, "mine")))
    with pytest.raises(PlanError, match=r"jsonl:1: parent = 'mine', must be the id"):
        dataclasses.replace(PROFILE, proposed_children=proposed)


@pytest.mark.parametrize("kind", ["parent", "child"])
def test_a_proposal_that_repeats_another_is_named(kind, write, plan):
    proposed = read_proposals(write(line(0, "s02"), line(0, "s02")))
    if kind == "parent":
        change, sample = {"parents": (Batch(2, proposals=proposed),)}, "p0001"
    else:
        change, sample = {"proposed_children": proposed}, "s02-c501"
    with pytest.raises(NoCandidateError, match=rf"{sample}: .*jsonl:2 is rejected"):
        plan(dataclasses.replace(PROFILE, **change))
