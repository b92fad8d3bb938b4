"""A plan is a pure function of its parameters, and growing it moves nothing."""

import dataclasses
import json
import subprocess
import sys

import pytest

from mpmworlds.builder.plan import plan
from mpmworlds.builder.plan.candidates import Draft
from mpmworlds.builder.plan.families import Choice
from mpmworlds.builder.plan.manifest import read_manifest, text_sha256
from mpmworlds.builder.plan.plan import write_plan
from mpmworlds.builder.plan.profile import Batch, Count, PlanError, sample_ids
from mpmworlds.builder.plan.proposed import Proposed
from mpmworlds.builder.recipes.modify import EDITS
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.files.locks import hold
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.assign import split_of
from mpmworlds.splits.ids import SampleId
from tests.builder.plan.plans import GROWN, SMALL, command, environment
from tests.sim.scenes import BODY, FAN, scene_data


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "manifest.parquet"
    write_plan(SMALL, path, workers=1)
    return path


@pytest.fixture(scope="module")
def rows(manifest):
    """Rows of the small plan by id."""
    return {row.id: row for row in read_manifest(manifest)}


# ---- what a plan is


def test_ids_are_known_beforehand_and_in_order(rows):
    assert list(rows) == sample_ids(SMALL) == sorted(rows)
    assert len(rows) == 3 * (1 + 1 + 1 + 1)


def test_nothing_but_the_manifest_and_the_count_of_the_rejected_stays(manifest):
    names = {path.name for path in manifest.parent.iterdir()}
    assert names == {"manifest.parquet", "manifest.rejected.json"}
    rejected = json.loads(manifest.with_suffix(".rejected.json").read_text())
    assert rejected.keys() == {"parents", "children"}


def test_lineage_is_what_the_id_says(rows):
    seeds = {name.split("_")[0]: name for name in load_seeds()}
    for name, row in rows.items():
        sample = SampleId.parse(name)
        assert row.family_id == sample.family
        assert row.kind == sample.kind
        assert row.parent_id == sample.made_from
        if row.parent_id:
            assert row.seeds == rows[row.parent_id].seeds
        assert set(row.seeds) <= set(seeds.values())
        assert len(row.seeds) in ((1,) if sample.is_of_seed_family else (2, 3))
        assert row.split == split_of(name, SMALL.split)
    assert rows["s02"].seeds == (seeds["s02"],)


def test_every_edit_is_recorded_and_changes_the_scene(rows):
    operators = {
        "seed": {""},
        "parent": {"compose"},
        "child": set(EDITS),
        "perturbation": {"perturb"},
    }
    for row in rows.values():
        edit = json.loads(row.edit) if row.edit else {"operator": ""}
        assert edit["operator"] in operators[row.kind]
        if row.parent_id:
            assert row.scene != rows[row.parent_id].scene
    assert len({row.scene for row in rows.values()}) == len(rows)


def test_perturbations_keep_the_structure_of_what_they_were_made_from(rows):
    for row in rows.values():
        if row.kind == "perturbation":
            one, other = (
                [
                    (t.name, t.object_type, t.shape.type, t.visualization.color)
                    for t in Scene.from_yaml(r.scene).objects
                ]
                for r in (row, rows[row.parent_id])
            )
            assert one == other
            assert row.materials == rows[row.parent_id].materials


def test_columns_describe_the_scene(rows):
    for row in rows.values():
        scene = Scene.from_yaml(row.scene)
        models = {
            thing.physics_properties.constitutive_model
            for thing in scene.objects
            if hasattr(thing, "physics_properties")
        }
        assert row.materials == tuple(sorted(models))
        assert row.object_types == tuple(sorted({t.object_type for t in scene.objects}))
        assert (row.num_objects, row.num_materials) == (len(scene.objects), len(models))
        assert row.scene_sha256 == text_sha256(row.scene)
        assert row.program_sha256 == text_sha256(link(scene))


def test_scenes_have_the_resolution_and_length_of_the_profile(rows):
    for row in rows.values():
        scene = Scene.from_yaml(row.scene)
        sim = scene.simulation
        assert (sim.grid_resolution, sim.duration_frames) == (64, 5)
        assert scene.output.resolution == 64
        assert sim.time_step_dt * sim.substeps_per_frame == pytest.approx(0.01)


# ---- what it depends on


def test_growing_a_plan_leaves_its_rows_as_they_were(rows, tmp_path):
    """More seeds, another batch of parents, more children, more perturbations."""
    planned = write_plan(GROWN, tmp_path / "m.parquet", workers=2)
    grown = {row.id: row for row in planned.rows}
    assert list(grown) == sample_ids(GROWN)
    assert len(grown) > 3 * len(rows)
    assert {name: grown[name] for name in rows} == rows


def test_another_root_seed_is_another_plan(rows, tmp_path):
    profile = dataclasses.replace(
        SMALL, root_seed=12, seeds=(), parents=(Batch(1, 35),)
    )
    other = write_plan(profile, tmp_path / "m.parquet", workers=1).rows
    assert all(row.scene != rows[row.id].scene for row in other)


@pytest.mark.parametrize(("seed", "workers"), [("1", 1), ("2", 2)])
def test_a_plan_is_the_same_file_whatever_the_hashing_and_the_workers(
    manifest, tmp_path, seed, workers
):
    path = tmp_path / "m.parquet"
    subprocess.run(
        command(path, "SMALL", workers),
        env=environment(PYTHONHASHSEED=seed),
        check=True,
        capture_output=True,
    )
    assert path.read_bytes() == manifest.read_bytes()
    one, other = (p.with_suffix(".rejected.json") for p in (path, manifest))
    assert one.read_bytes() == other.read_bytes()


def first_form(scene):
    return scene.objects[0].shape.type


def test_a_parent_that_nearly_repeats_a_root_before_it_is_drawn_again(
    tmp_path, monkeypatch
):
    """Here two roots are near if their first objects are of the same shape."""

    def is_near(scene, others, distance):
        return first_form(scene) in map(first_form, others)

    def forms(planned):
        return {row.id: first_form(Scene.from_yaml(row.scene)) for row in planned.rows}

    parents = dataclasses.replace(
        SMALL,
        seeds=(),
        parents=(Batch(4, 35),),
        children=(Count(0),),
        root_perturbations=(Count(0),),
    )
    before = forms(write_plan(parents, tmp_path / "before.parquet", workers=1))
    monkeypatch.setattr(plan, "structure", lambda scene: "any")
    monkeypatch.setattr(plan, "load_seeds", dict)
    monkeypatch.setattr(plan, "is_near", is_near)
    planned = write_plan(parents, tmp_path / "after.parquet", workers=1)
    after = forms(planned)
    assert len(set(before.values())) < len(before)
    assert len(set(after.values())) == len(after)
    assert planned.rejected["parents"]["near_duplicate"] >= len(before) - len(
        set(before.values())
    )
    taken = set()
    for name, form in before.items():
        if form not in taken:  # nothing before it is near: it stays
            assert after[name] == form
        taken.add(after[name])


SEEDS = list(load_seeds().values())
NEW = [Scene.from_data(scene_data(*things)) for things in ((), (BODY, FAN))]


PROPOSED = Batch(1, proposals=(Proposed("p.jsonl:1", (), "", "{}", ""),))


def choice(name, scene, draw=0, rejected=()):
    """A root that shows a scene."""
    sample = SampleId(name)
    draft = Draft(sample, sample.kind, "", (), "", scene, scene)
    return sample, Choice(draft, draw, rejected)


@pytest.mark.parametrize(
    ("choices", "expected"),
    [
        ([choice("p0000", NEW[0]), choice("p0001", NEW[1])], {}),
        ([choice("p0000", NEW[0]), choice("p0001", NEW[0])], {"p0001": {0}}),
        ([choice("p0000", SEEDS[2], 1, ("no_room",))], {"p0000": {1}}),
        (
            [choice("p0000", SEEDS[2], 2, ("near_duplicate", "overlap"))],
            {"p0000": {0, 2}},
        ),
        ([choice("p0000", SEEDS[30])], {}),  # s30 came later
        ([choice("p0002", SEEDS[30])], {"p0002": {0}}),
        ([choice("p0003", SEEDS[30])], {"p0003": {0}}),  # a model saw them all
        ([choice("s01", NEW[0]), choice("s02", NEW[0])], {}),  # seeds are as they are
    ],
)
def test_a_parent_may_not_repeat_a_parent_nor_a_seed_that_was_there(choices, expected):
    """Whether the seed is in the corpus does not count, so that it may join later."""
    profile = dataclasses.replace(SMALL, parents=(Batch(2, 10), Batch(1, 35), PROPOSED))
    found = plan._first_repeat(profile, dict(choices), SEEDS)
    assert {str(sample): set(draws) for sample, draws in found.items()} == expected


# ---- errors


def test_a_seed_that_there_is_not_is_an_error_before_anything_is_planned(tmp_path):
    profile = dataclasses.replace(SMALL, seeds=("s99",))
    with pytest.raises(PlanError, match="no seed 's99'; there are s00, s01"):
        write_plan(profile, tmp_path / "m.parquet")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_being_planned_is_left_alone(tmp_path):
    path = tmp_path / "m.parquet"
    busy = pytest.raises(FileExistsError, match=r"m\.parquet: another process is")
    with hold(tmp_path / ".m.parquet.lock"), busy:
        write_plan(SMALL, path)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_named(tmp_path):
    code = (
        "import resource, signal, sys\n"
        "from pathlib import Path\n"
        "from mpmworlds.builder.plan.plan import write_plan\n"
        "from tests.builder.plan.plans import ONE\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))\n"
        "write_plan(ONE, Path(sys.argv[1]), workers=1)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "m.parquet")],
        env=environment(),
        capture_output=True,
        text=True,
    )
    assert "DiskFullError" in done.stderr
    assert "no room to write it" in done.stderr.splitlines()[-1]
