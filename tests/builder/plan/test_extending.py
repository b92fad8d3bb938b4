"""Extending moves nothing: not a byte of a scene, an id or a split that there was.

A copy of the package gets a material, a motion, a shape, an edit and a seed; its
parameters get a second version of the tables, which names them, and new batches of
parents, children and perturbations that are drawn from it.
"""

import copy
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from mpmworlds.builder.plan.manifest import read_manifest

ROOT = Path(__file__).parents[3]
FEATURES = {"materials": "neo_hookean", "motions": "pendulum", "shapes": "crescent"}
EDIT = '''

def mirror_object(means: Means, scene: Data) -> Data:
    """Exchange left and right of one object."""
    thing = means.one_of(scene["objects"])
    mirror(thing)
    return {"object": thing["name"]}


EDITS["mirror_object"] = mirror_object
'''
MOTION = '''

def pendulum(rng: np.random.Generator, shape: Data, sign: float) -> Data:
    """A swing about a pivot above the center."""
    return {"length": 0.1, "swing_deg": sign * rounded(rng.uniform(10.0, 20.0), 1)}


MOTIONS["pendulum"] = pendulum
'''
PARAMS = {
    "version": "0.1.0",
    "root_seed": 7,
    "profiles": {
        "small": {
            "seeds": ["s02", "s04"],
            "parents": [{"count": 4, "seeds": 35}],
            "children": 3,
            "root_perturbations": 2,
            "child_perturbations": {"each": 1, "more": 2},
            "screen": "none",
            "grid_resolution": 64,
            "resolution": 64,
            "duration_frames": 5,
            "split": {"salt": "a", "test_fraction": 0.4, "modification_fraction": 0.3},
            "rows_per_shard": 4,
        }
    },
}


def extended_params():
    """The same parameters with more of everything."""
    tables = yaml.safe_load((ROOT / "params.yaml").read_text())["tables"]
    second = copy.deepcopy(tables["v1"])
    second["materials"] = {"neo_hookean": 3.0} | second["materials"]
    second["typical"]["neo_hookean"] = {
        "density": 1000.0,
        "youngs_modulus": 2.0e5,
        "poissons_ratio": 0.3,
        "damping": 0.0,
    }
    second["edits"] = {"mirror_object": 1.0} | second["edits"]
    second["motions"] = {"pendulum": 2.0} | second["motions"]
    second["new_shapes"]["crescent"] = {"radius": 1.3, "offset": 0.8}
    second["jitter"]["position"] = {"shift": 0.01}
    params = copy.deepcopy(PARAMS) | {"tables": tables | {"v2": second}}
    profile = params["profiles"]["small"]
    profile["seeds"] = ["s02", "s04", "s35"]
    profile["parents"] += [{"count": 3, "seeds": 36, "tables": "v2"}]
    profile["children"] = [3, {"each": 3, "tables": "v2"}]
    profile["root_perturbations"] = [2, {"each": 1, "tables": "v2"}]
    profile["child_perturbations"] = [
        {"each": 1, "more": 2},
        {"each": 1, "tables": "v2"},
    ]
    return params


@pytest.fixture(scope="module")
def extended(tmp_path_factory):
    """A copy of the package that has learned all of that."""
    folder = tmp_path_factory.mktemp("extended")
    home = folder / "mpmworlds"
    ignored = shutil.ignore_patterns("full*", "__pycache__")
    shutil.copytree(ROOT / "src/mpmworlds", home, symlinks=False, ignore=ignored)
    shutil.copy(ROOT / "params.yaml", home / "params.yaml")
    for room, name in FEATURES.items():
        source = ROOT / f"tests/sim/extensions/{name}.py"
        shutil.copy(source, home / f"sim/program/features/{room}/{name}.py")
    seeds = home / "builder/seeds"
    text = (seeds / "s04_bouncing_blocks.yaml").read_text().replace("0.1", "0.11")
    (seeds / "s35_more_blocks.yaml").write_text(text)
    for name, more in (("modify", EDIT), ("motions", MOTION)):
        path = home / f"builder/recipes/{name}.py"
        path.write_text(path.read_text() + more)
    return folder


def planned(folder, params, home):
    """Rows of a plan by id, and its file, by the command of a package."""
    (folder / "params.yaml").write_text(yaml.safe_dump(params))
    path = folder / "manifest.parquet"
    command = ["plan", "--params", folder / "params.yaml", "--config", "small"]
    done = subprocess.run(
        [sys.executable, "-m", "mpmworlds", *command, "--out", path, "--workers", "2"],
        env=os.environ | {"PYTHONPATH": str(home)},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {row.id: row for row in read_manifest(path)}


@pytest.mark.slow
def test_extending_moves_nothing(extended, tmp_path):
    rows = planned(tmp_path, PARAMS, ROOT / "src")
    assert len(rows) == 6 + 18 + 12 + 18 + 6
    assert planned(tmp_path, PARAMS, extended) == rows
    grown = planned(tmp_path, extended_params(), extended)
    assert {name: grown[name] for name in rows} == rows
    added = [row for name, row in grown.items() if name not in rows]
    text = "".join(row.scene + row.edit for row in added)
    for word in ("neo_hookean", "mirror_object", "s35_more_blocks"):
        assert word in text or word in str([row.seeds for row in added]), word
    kinds = {row.kind for row in added}
    assert kinds == {"seed", "parent", "child", "perturbation"}


def test_a_version_that_there_is_not_is_named(tmp_path, command):
    params = copy.deepcopy(PARAMS)
    params["profiles"]["small"]["children"] = {"each": 1, "tables": "v7"}
    path = tmp_path / "params.yaml"
    path.write_text(yaml.safe_dump(params))
    out = tmp_path / "m.parquet"
    options = ["--params", path, "--config", "small", "--out", out]
    status, _, err = command("plan", *options)
    assert status == 2
    assert "tables: there is no version 'v7', only v1" in err


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"materials": {"jam": 1.0}}, "materials: 'jam', must be one of elastic, "),
        ({"edits": {"add_object": -1.0}}, "edits.add_object = -1.0, must be > 0"),
        ({"jitter": {"smell": {}}}, "jitter: 'smell', must be one of acceleration, "),
        ({"jitter": {"angle": {"factor": 0.5}}}, "factor = 0.5, must be >= 1"),
        ({"colour": 1}, "colour is not a known key"),
    ],
)
def test_tables_that_make_no_sense_are_named(change, told, tmp_path, command):
    tables = yaml.safe_load((ROOT / "params.yaml").read_text())["tables"]
    params = copy.deepcopy(PARAMS) | {"tables": {"v1": tables["v1"] | change}}
    path = tmp_path / "params.yaml"
    path.write_text(yaml.safe_dump(params))
    out = tmp_path / "m.parquet"
    options = ["--params", path, "--config", "small", "--out", out]
    status, _, err = command("plan", *options)
    assert status == 2
    assert told in err
