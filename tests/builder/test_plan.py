"""A plan is a pure function of its parameters, and growing it moves nothing."""

import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mpmworlds.builder.attempt import NoCandidateError
from mpmworlds.builder.manifest import read_manifest, text_sha256
from mpmworlds.builder.modify import EDITS
from mpmworlds.builder.plan import PlanError, Profile, sample_ids, write_plan
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.link import link
from mpmworlds.sim.scene import Scene
from mpmworlds.splits.assign import SplitParams, split_of
from mpmworlds.splits.ids import SampleId

SMALL = Profile(
    root_seed=11,
    seeds=("s02",),
    parents=2,
    children=1,
    root_perturbations=1,
    child_perturbations=1,
    grid_resolution=64,
    resolution=64,
    duration_frames=5,
    split=SplitParams("test", 0.4, 0.5),
)
GROWN = dataclasses.replace(
    SMALL, seeds=("s01", "s02"), parents=3, children=2, root_perturbations=2
)
WRITE = """\
import sys
from pathlib import Path
from tests.builder.test_plan import SMALL, write_plan
write_plan(SMALL, Path(sys.argv[1]))
"""


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "manifest.parquet"
    write_plan(SMALL, path)
    return path


@pytest.fixture(scope="module")
def rows(manifest):
    """Rows of the small plan by id."""
    return {row.id: row for row in read_manifest(manifest)}


def test_ids_are_known_beforehand_and_in_order(rows):
    assert list(rows) == sample_ids(SMALL) == sorted(rows)
    assert len(rows) == 3 * (1 + 1 + 1 + 1)


def test_growing_a_plan_leaves_its_rows_as_they_were(rows, tmp_path):
    grown = {row.id: row for row in write_plan(GROWN, tmp_path / "m.parquet")}
    assert len(grown) > 2 * len(rows)
    assert {name: grown[name] for name in rows} == rows


def test_another_root_seed_is_another_plan(rows, tmp_path):
    profile = dataclasses.replace(SMALL, root_seed=12, seeds=(), parents=1)
    other = {row.id: row for row in write_plan(profile, tmp_path / "m.parquet")}
    assert all(other[name].scene != rows[name].scene for name in other)


def test_a_plan_is_the_same_file_whatever_the_order_of_hashing(manifest, tmp_path):
    for seed in ("1", "2"):
        path = tmp_path / f"{seed}.parquet"
        root = Path(__file__).parents[2]
        subprocess.run(
            [sys.executable, "-c", WRITE, path],
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": str(root)},
            check=True,
            capture_output=True,
        )
        assert path.read_bytes() == manifest.read_bytes()


def test_lineage_is_what_the_id_says(rows):
    seeds = {name.split("_")[0]: name for name in load_seeds()}
    for name, row in rows.items():
        sample = SampleId.parse(name)
        assert row.family_id == sample.family
        if name == sample.family:
            assert row.parent_id == ""
            assert row.kind == ("seed" if name in seeds else "parent")
        else:
            perturbed = sample.perturbation is not None
            assert row.kind == ("perturbation" if perturbed else "child")
            assert row.parent_id == (sample.template if perturbed else sample.family)
            assert row.seeds == rows[row.parent_id].seeds
        assert set(row.seeds) <= set(seeds.values())
        assert len(row.seeds) == (1 if sample.is_of_seed_family else 2)
        assert row.split == split_of(name, SMALL.split)


def test_every_edit_is_recorded_and_changes_the_scene(rows):
    for row in rows.values():
        operators = {
            "seed": {""},
            "parent": {"compose"},
            "child": set(EDITS),
            "perturbation": {"perturb"},
        }
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


def test_a_seed_that_there_is_not_is_an_error(tmp_path):
    profile = dataclasses.replace(SMALL, seeds=("s99",))
    with pytest.raises(PlanError, match="no seed 's99'; there are s00, s01"):
        write_plan(profile, tmp_path / "m.parquet")
    assert not (tmp_path / "m.parquet").exists()


def test_a_sample_without_a_candidate_is_named_with_the_last_fault(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("mpmworlds.builder.attempt.MOST_DRAWS", 2)
    profile = dataclasses.replace(SMALL, seeds=(), resolution=63)
    with pytest.raises(NoCandidateError, match="p0000: no pair of seeds") as error:
        write_plan(profile, tmp_path / "m.parquet")
    assert "none of 2 draws is a valid scene (last: " in str(error.value)
    assert "output.resolution = 63, must be even" in str(error.value)


@pytest.mark.parametrize(
    ("profiles", "message"),
    [
        ({}, "profile 'tiny' is not in params.yaml; it has"),
        ({"tiny": {"seeds": [], "split": {}}}, "params.yaml: profile 'tiny': "),
        ({"tiny": {"seeds": []}}, "params.yaml: profile 'tiny': 'split'"),
    ],
)
def test_parameters_that_are_no_profile_are_an_error(profiles, message):
    with pytest.raises(PlanError, match=message):
        Profile.from_params({"root_seed": 1, "profiles": profiles}, "tiny")
