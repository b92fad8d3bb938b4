"""The recorded corpus is the one that the recorded parameters give."""

import json
from collections import Counter
from pathlib import Path

import pyarrow.compute as pc
import pytest
import yaml

from mpmworlds.builder.plan.candidates import scene_key
from mpmworlds.builder.plan.evaluation import recorded_measured
from mpmworlds.builder.plan.families import Screen, Templates, plan_family
from mpmworlds.builder.plan.manifest import read_manifest, read_table
from mpmworlds.builder.plan.profile import Profile, sample_ids
from mpmworlds.builder.plan.screen import fault
from mpmworlds.builder.plan.trials import RECORDED, read_recorded
from mpmworlds.cli import main
from mpmworlds.files.checksums import sha256_of_file
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.assign import split_of
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.recorded_lists import read_lists

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "builder/recorded"
FULL = FOLDER / "full.parquet"
PROFILE = Profile.from_params(
    yaml.safe_load((ROOT / "params.yaml").read_text()), "full"
)
PINNED = {
    "full.evaluation.parquet": (
        "68934a5f3b034443b3839f9fbccb78cde66c6785e04e6c19bbf28a5a9bed8e7d"
    ),
    "full.jsonl": ("1059472d42dab9ce19a7657c5718a38877f5107490de3d3812bad814c999acf5"),
    "full.parquet": (
        "3a24302876a7ca8714117f882c537e9d93e02c811fced27157f550693c1b857c"
    ),
    "full.rejected.json": (
        "29d659a1cb17626c72faab566687f9fdd2a4477dc31d6179c9d24b4343535466"
    ),
    "full.trials.parquet": (
        "8ba19b51fbdaf52b56a1dc2ce4a60221a453e5a1463993cb2d625f464e951f36"
    ),
}
SPOTS = ("s07", "p0000", "p0500", "p0964")  # families that are planned anew


def test_files_are_those_of_the_checksums():
    assert {name: sha256_of_file(FOLDER / name) for name in PINNED} == PINNED
    assert FULL.stat().st_size <= 25e6


def test_hashes_of_videos_are_recorded_for_mini_and_for_what_is_evaluated():
    lines = (FOLDER / "full.jsonl").read_text().splitlines()
    recorded = {line["id"]: line["program_sha256"] for line in map(json.loads, lines)}
    lists = read_lists(ROOT / "splits/recorded/full")
    names = [n for n in lists if n.startswith(("evaluation_", "mini_"))]
    assert set(recorded) == {sample for name in names for sample in lists[name]}
    table = read_table(FULL, ["id", "program_sha256"])
    columns = (table[name].to_pylist() for name in ("id", "program_sha256"))
    programs = dict(zip(*columns, strict=True))
    assert recorded == {sample: programs[sample] for sample in recorded}


def test_corpus_has_the_size_of_the_paper():
    table = read_table(FULL, ["id", "kind", "family_id"])
    kinds = Counter(table["kind"].to_pylist())
    assert kinds == {
        "seed": 35,
        "parent": 965,
        "child": 8204,
        "perturbation": 86601,
    }
    assert table["id"].to_pylist() == sample_ids(PROFILE)
    assert len(pc.unique(table["family_id"])) == 1000


def test_seeds_are_always_in_train():
    table = read_table(FULL, ["family_id", "split"])
    of_seeds = pc.starts_with(table["family_id"], "s")
    assert set(table.filter(of_seeds)["split"].to_pylist()) <= {
        "train",
        "modification_validation",
    }


@pytest.mark.slow
def test_families_planned_anew_are_the_recorded_ones():
    templates = Templates(PROFILE, Screen(read_recorded(RECORDED)))
    recorded = {row.id: row for row in read_manifest(FULL)}
    for name in SPOTS:
        root = SampleId.parse(name)
        if root.is_of_seed_family:
            choice = templates.seed(root)
        else:
            choice = templates.parent(root, ())
        family = plan_family(templates, choice)
        assert family.rows == [recorded[row.id] for row in family.rows]
        assert [row.id for row in family.rows] == list(map(str, PROFILE.family(root)))
    assert not templates.screen.new, "a trial was run that is not recorded"


def test_evaluation_samples_move_and_are_no_chaos():
    found = {m.id: m for m in recorded_measured("full")}
    lists = read_lists(ROOT / "splits/recorded/full")
    names = [*lists["evaluation_test"], *lists["evaluation_modification"]]
    assert len(names) == 240
    for name in names:
        assert found[name].fault is None
        assert found[name].motion >= 0.05
        assert found[name].ceiling["mask_iou"] >= 0.5
    by_id = {row.id: row for row in read_manifest(FULL)}
    assert all(by_id[m.id].program_sha256 == m.program_sha256 for m in found.values())


def test_lists_are_recomputed(capsys):
    lists = ["--dir", str(ROOT / "splits/recorded/full")]
    assert main(["splits", "--config", "full", "--check", *lists]) == 0, (
        capsys.readouterr().out
    )


def test_statistics_are_those_of_the_paper(capsys):
    assert main(["stats", "--manifest", str(FULL), "--check"]) == 0, (
        capsys.readouterr().out
    )


def test_recorded_findings_are_those_of_the_templates_and_of_what_was_rejected():
    found = read_recorded([FOLDER / "full.trials.parquet"])
    templates = [
        row
        for row in read_table(FULL, ["id", "kind", "scene"]).to_pylist()
        if row["kind"] != "perturbation"
    ]
    faults = Counter(
        (row["kind"], fault(found[scene_key(Scene.from_yaml(row["scene"]))]))
        for row in templates
    )
    assert faults == {
        ("seed", None): 34,
        ("seed", "at_rest_after_prefix"): 1,  # s28, made by hand and kept
        ("parent", None): 965,
        ("child", None): 8204,
    }
    rejected = json.loads((FOLDER / "full.rejected.json").read_text())
    reasons = Counter(filter(None, map(fault, found.values())))
    reasons["at_rest_after_prefix"] -= 1
    for reason, count in reasons.items():  # a scene may be drawn and rejected again
        assert 0 < count <= sum(kind.get(reason, 0) for kind in rejected.values())


def test_recorded_audit_finds_no_leak():
    """The pipeline holds it to the manifest and to the code that audits."""
    audit = json.loads((FOLDER / "full.audit.json").read_text())
    assert (audit["samples"], audit["templates"]) == (95_805, 9_204)
    assert audit["problems"] == []
    for pair in audit["kin"]:  # meant to be near: a modification and its own family
        families = {SampleId.parse(name).family for name in pair["ids"]}
        assert len(families) == 1


@pytest.mark.long
def test_audit_of_the_corpus_finds_no_leak(capsys):
    status = main(["audit", "--json"])
    found = json.loads(capsys.readouterr().out)
    recorded = json.loads((FOLDER / "full.audit.json").read_text())
    assert status == 0
    assert found | {"manifest": ""} == recorded | {"manifest": ""}


@pytest.mark.parametrize("subset", ["mini", "10k"])
def test_parents_of_a_subset_s_modifications_are_in_its_train(subset):
    lists = read_lists(ROOT / "splits/recorded/full")
    modified = lists[f"{subset}_modification_validation"]
    assert {SampleId.parse(name).family for name in modified} <= set(
        lists[f"{subset}_train"]
    )


def test_mini_is_a_part_of_10k_with_rows_of_every_split(capsys):
    assert main(["materialise", "--config", "mini", "--list-ids"]) == 0
    mini = set(capsys.readouterr().out.split())
    assert main(["materialise", "--config", "10k", "--list-ids"]) == 0
    larger = set(capsys.readouterr().out.split())
    assert (len(mini), len(larger)) == (100, 10_000)
    assert mini < larger
    splits = Counter(split_of(name, PROFILE.split) for name in mini)
    assert splits == {"train": 60, "test": 24, "modification_validation": 16}
