"""What the package has recorded is compared with a release."""

import shutil

import numpy as np
import pytest

from mpmworlds.builder.parameters import Parameters
from mpmworlds.builder.plan.manifest import read_table, recorded_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.checks import values
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.release.verify import verify_release
from mpmworlds.builder.render.store import Store
from mpmworlds.files.checksums import write_checksums
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.recorded_lists import read_lists, write_lists
from tests.builder.release.verify.damage import (
    changed,
    edited,
    findings_of,
    found,
    rewrite,
)


@pytest.fixture(scope="module")
def package_recipes(tmp_path_factory):
    """Folder of a release of the package's corpus, with one wrong video. Read-only."""
    root = tmp_path_factory.mktemp("package")
    params, store = Parameters.read(), Store(root / "store")
    rows = read_table(recorded_manifest("tiny"))
    (row,) = (row for row in rows.to_pylist() if row["id"] == "s01")
    scene = Scene.from_yaml(row["scene"])
    side, count = scene.output.resolution, scene.simulation.duration_frames
    frames = np.zeros((count, side, side, 3), np.uint8)
    store.put(link(scene), frames, scene.output.framerate)
    planned = Corpus(
        recorded_manifest("tiny"),
        {"some": ["s01"]},
        name="tiny",
        lists=params.lists_of("tiny", rows["id"].to_pylist()),
        rows_per_shard=params.rows_per_shard("tiny"),
    )
    out = root / "mpmworlds"
    build_release([planned], store, out, version=params.version)
    return out


SOME = "data/some/train-00000-of-00001.arrow"


@pytest.fixture
def package_copy(package_recipes, tmp_path):
    return shutil.copytree(package_recipes, tmp_path / "copy")


def test_recipes_of_the_package_are_compared_with_its_own(package_recipes):
    verified = verify_release(package_recipes, resimulate=0)
    assert verified.recorded == ("tiny",)
    (finding,) = map(str, verified.findings)
    start = f"{SOME}: s01: frames_sha256 is not what this version of mpmworlds records"
    assert finding.startswith(start)


def test_a_key_that_is_not_that_of_the_rows_is_found(package_copy):
    edited(package_copy, lambda record: record["configs"]["some"].update(key="0" * 64))
    fault = "the key of some is not that of its rows; build some again"
    assert found(findings_of(package_copy), "release.json", fault)


def test_a_row_that_is_not_that_of_the_package_is_found(package_copy):
    rewrite(package_copy, SOME, changed(motion=0.75))
    fault = (
        "its recipe (id to program_sha256) is not that of the corpus of this package"
    )
    assert found(findings_of(package_copy), f"{SOME}: s01", fault)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (changed(motion=0.75), "its recipe (id to program_sha256) is not that of"),
        (changed(framerate=15), "framerate = 15, its scene says"),
        (changed(num_frames=3), "num_frames = 3, its scene says"),
        (changed(materials=["snow"]), "materials = ['snow'], its scene says"),
        (changed(program="pass"), "its program is not the one that program_sha256"),
        (changed(kind="child"), "kind = 'child', its id says"),
    ],
)
def test_the_quick_check_finds_wrong_values_of_recorded_rows(
    package_copy, change, fault
):
    rewrite(package_copy, SOME, change)
    assert found(findings_of(package_copy, videos=False), f"{SOME}: s01", fault)


def test_the_quick_check_links_no_row_that_is_as_recorded(package_copy, monkeypatch):
    def refuse(scene):
        raise AssertionError(f"linked {scene}")

    monkeypatch.setattr(values, "link", refuse)
    values._facts_of.cache_clear()
    assert len(findings_of(package_copy, videos=False)) == 1  # its wrong frames_sha256
    with pytest.raises(AssertionError, match="linked"):
        findings_of(package_copy)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (changed(motion=0.25), "motion = 0.25, must be "),
        (changed(seeds=["other"]), "seeds = ['other'], must be "),
        (lambda rows: rows[::-1], "row 0 is "),
        (lambda rows: rows[1:], "row 0 is "),
        (lambda rows: rows + rows[:1], "is missing, must"),
    ],
)
def test_recipes_that_are_not_those_of_the_package_are_found(
    package_copy, change, fault
):
    name = "data/recipes/train-00000-of-00001.arrow"
    if fault == "is missing, must":
        fault = "is there twice"
    rewrite(package_copy, name, change)
    assert any(fault in line for line in findings_of(package_copy)), fault


def test_lists_that_are_not_those_of_the_package_are_found(package_copy):
    lists = read_lists(package_copy / "splits")
    write_lists(package_copy / "splits", lists | {"more": ["s01"]})
    write_checksums(package_copy)
    fault = "is not as this version of mpmworlds records it"
    assert found(findings_of(package_copy), "splits/more.txt", fault)
