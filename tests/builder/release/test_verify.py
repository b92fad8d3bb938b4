"""Whatever is wrong with a release is found; nothing is found where nothing is."""

import shutil
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from mpmworlds.builder.plan.manifest import text_sha256, write_manifest
from mpmworlds.builder.release import shard_check
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.features import recipe_features, release_features
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.release.verify import verify_release
from mpmworlds.builder.render.store import Store
from mpmworlds.files.checksums import write_checksums
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import encode_mp4, frames_sha256
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.recorded_lists import read_lists, write_lists
from tests.planted import planted

SCENE = """
schema: mpmworlds-scene/1
simulation: {{grid_resolution: 32, time_step_dt: 1.0e-4, substeps_per_frame: 2,
             duration_frames: 3, particles_per_cell: 4, seed: 7}}
objects:
- name: object_0
  object_type: dynamic_body
  shape: {{type: box, center: [0.5, 0.5], size: [0.3, 0.3]}}
  physics_properties: {{constitutive_model: elastic, density: 1000.0,
                       youngs_modulus: 5.0e+4, poissons_ratio: 0.2}}
  visualization: {{color: '{color}'}}
output: {{resolution: 64, framerate: 30}}
"""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory, make_row):
    """Folder of a small release of simulated samples. Read-only."""
    root = tmp_path_factory.mktemp("simulated")
    store, rows = Store(root / "store"), []
    for sample_id, split, color in (
        ("p0000", "train", PALETTE["red"]),
        ("p0001", "test", PALETTE["sky"]),
    ):
        scene = Scene.from_yaml(SCENE.format(color=color))
        program = link(scene)
        store.put(program, run(program).expect(), scene.output.framerate)
        row, text = make_row(sample_id, split, program), scene.to_yaml()
        rows.append(replace(row, scene=text, scene_sha256=text_sha256(text)))
    write_manifest(root / "manifest.parquet", rows)
    out = root / "mpmworlds"
    planned = Corpus(root / "manifest.parquet", {"tiny": None})
    build_release([planned], store, out, version="1.0.0")
    return out


@pytest.fixture
def copy(simulated, tmp_path):
    return shutil.copytree(simulated, tmp_path / "copy")


TEST_SHARD = Path("data/tiny/test-00000-of-00001.arrow")


def rows_of(path):
    with pa.OSFile(str(path), "rb") as file:
        return pa.ipc.open_stream(file).read_all().to_pylist()


def rewrite(path, change, features=None):
    """Change the rows of a shard and make its checksum right again."""
    rows = change(rows_of(path))
    schema = (features or release_features()).arrow_schema
    with (
        pa.OSFile(str(path), "wb") as file,
        pa.ipc.new_stream(file, schema) as writer,
    ):
        writer.write_table(pa.Table.from_pylist(rows, schema=schema))
    write_checksums(path.parents[2])


def changed(**values):
    return lambda rows: [row | values for row in rows]


def test_a_release_as_it_was_built_has_no_findings(simulated):
    assert verify_release(simulated, resimulate=1) == []


def test_a_flipped_bit_is_found(copy):
    data = bytearray((copy / TEST_SHARD).read_bytes())
    data[-300] ^= 1
    (copy / TEST_SHARD).write_bytes(data)
    findings = verify_release(copy, resimulate=0)
    assert f"{copy / TEST_SHARD}: its sha256 is not the one in SHA256SUMS" in findings


def test_a_truncated_shard_is_found(copy):
    data = (copy / TEST_SHARD).read_bytes()
    (copy / TEST_SHARD).write_bytes(data[: len(data) // 2])
    assert any(
        f"{copy / TEST_SHARD}: cannot be read" in finding
        for finding in verify_release(copy, resimulate=0)
    )


def test_text_that_is_none_is_found_beside_the_checksum(copy):
    path = copy / "data/recipes/test-00000-of-00001.arrow"
    data = path.read_bytes()
    place = data.index(b"mpmworlds-scene/1")
    path.write_bytes(data[:place] + b"\xff" + data[place + 1 :])
    findings = verify_release(copy, resimulate=0)
    assert f"{path}: its sha256 is not the one in SHA256SUMS" in findings
    assert any(f"{path}: cannot be read ('utf-8' codec" in text for text in findings)


def test_missing_and_extra_files_are_found(copy):
    (copy / TEST_SHARD).unlink()
    (copy / "data/tiny/extra-00000-of-00001.arrow").write_bytes(b"")
    findings = verify_release(copy, resimulate=0)
    assert f"{copy / TEST_SHARD}: is missing, SHA256SUMS names it" in findings
    assert any("extra-00000" in f and "does not name it" in f for f in findings)
    assert f"{copy}: tiny/test has 0 rows, the card: 1" in findings


def other_video(rows):
    video = encode_mp4(np.zeros((3, 64, 64, 3), np.uint8), 30)
    return [row | {"video": {"bytes": video, "path": None}} for row in rows]


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (changed(split="train"), "p0001: split = 'train', in another's file"),
        (changed(scene="scene"), "p0001 of tiny is not as in recipes"),
        (changed(program="pass"), "p0001: its program is not the one that program_sha"),
        (changed(program_sha256="0"), "p0001: its program is not the one that progr"),
        (changed(frames_sha256="0"), "p0001: its video does not hold the frames that"),
        (changed(num_frames=4), "p0001: its video is (3, 64, 64) (frames, height, wid"),
        (changed(video={"bytes": b"x", "path": ""}), "p0001: its video cannot be deco"),
        (other_video, "p0001: its video does not hold the frames that frames_sha256"),
        (lambda rows: rows * 2, "tiny/test has 2 rows, the card: 1"),
        (lambda rows: rows * 2, "tiny/test has an id more than once"),
    ],
)
def test_a_wrong_row_under_a_right_checksum_is_found(copy, change, finding):
    rewrite(copy / TEST_SHARD, change)
    findings = verify_release(copy, resimulate=0)
    assert any(finding in text for text in findings), findings


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (changed(scene="a: 1\n"), "p0001: its scene is not the one that scene_sha256"),
        (changed(scene="a: 1\n"), "p0001: its scene is not valid: p0001: "),
        (changed(program_sha256="0"), "p0001: its scene links to another program"),
        (changed(edit="{}"), "p0001 of tiny is not as in recipes"),
    ],
)
def test_a_wrong_recipe_under_a_right_checksum_is_found(copy, change, finding):
    path = copy / "data/recipes/test-00000-of-00001.arrow"
    rewrite(path, change, features=recipe_features())
    findings = verify_release(copy, resimulate=0)
    assert any(finding in text for text in findings), findings


def linked(monkeypatch, copy, sample_id, rows_of_a_file):
    """Return the findings on a sample that says it links to another program."""
    monkeypatch.setattr(shard_check, "LINKED", rows_of_a_file)
    rewrite(
        copy / "data/recipes/test-00000-of-00001.arrow",
        changed(program_sha256="0" * 64),
        features=recipe_features(),
    )
    findings = verify_release(copy, resimulate=0)
    return [text for text in findings if f"{sample_id}: its scene links to" in text]


def test_of_many_recipes_some_are_linked(monkeypatch, copy):
    assert linked(monkeypatch, copy, "p0001", rows_of_a_file=1)
    assert not linked(monkeypatch, copy, "p0001", rows_of_a_file=0)


def test_of_rendered_rows_all_are_linked(monkeypatch, copy):
    other = Scene.from_yaml(SCENE.format(color=PALETTE["green"])).to_yaml()
    change = changed(scene=other, scene_sha256=text_sha256(other))
    rewrite(copy / TEST_SHARD, change)
    assert linked(monkeypatch, copy, "p0001", rows_of_a_file=0)


def test_several_processes_find_the_same(copy):
    rewrite(copy / TEST_SHARD, changed(frames_sha256="0"))
    findings = verify_release(copy, resimulate=0, workers=2)
    assert findings == verify_release(copy, resimulate=0)
    assert findings


def test_other_columns_are_found(copy):
    def recipe(rows):
        return [{name: row[name] for name in recipe_features()} for row in rows]

    rewrite(copy / TEST_SHARD, recipe, features=recipe_features())
    findings = verify_release(copy, resimulate=0)
    assert any(
        "its columns or their types are not those of a" in text for text in findings
    )


def test_a_list_that_differs_from_the_rows_is_found(copy):
    rewrite(
        copy / "data/recipes/test-00000-of-00001.arrow",
        changed(id="p0777"),
        features=recipe_features(),
    )
    findings = verify_release(copy, resimulate=0)
    assert f"{copy}: p0001 of test is only in splits/test.txt" in findings
    assert f"{copy}: p0777 of test is only in the rows" in findings


def test_a_list_of_samples_that_there_are_not_is_found(copy):
    lists = read_lists(copy / "splits")
    write_lists(copy / "splits", lists | {"evaluation_test": ["p0001", "p0009"]})
    write_checksums(copy)
    assert verify_release(copy, resimulate=0) == [
        f"{copy}: p0009 of splits/evaluation_test.txt is not in the rows"
    ]


def forged(rows):
    """Another video for the same programs, with the hash of its frames."""
    hashed = frames_sha256(np.zeros((3, 64, 64, 3), np.uint8))
    return [row | {"frames_sha256": hashed} for row in other_video(rows)]


def rewrite_rendered(copy, change):
    for path in sorted(copy.glob("data/tiny/*.arrow")):
        rewrite(path, change)


def test_frames_that_the_program_does_not_render_are_found(copy):
    rewrite_rendered(copy, forged)
    told = "simulated again, it gives other frames on this machine"
    findings = verify_release(copy, resimulate=2)
    assert sorted(findings) == [f"{name}: {told}" for name in ("p0000", "p0001")]


def test_a_row_with_findings_is_not_simulated_again(copy):
    rewrite_rendered(copy, changed(program="raise ValueError\n"))
    findings = verify_release(copy, resimulate=2)
    assert any("its program is not the one that program_sha" in f for f in findings)
    assert not any("simulated again" in text for text in findings)


@pytest.mark.parametrize("hashes", ["stale sums", "stale", "fixed up", "all fixed up"])
def test_a_program_that_was_tampered_with_is_found_and_never_run(
    copy, tmp_path, hashes
):
    mark = tmp_path / "was here"
    sums = (copy / "SHA256SUMS").read_bytes()

    def plant(rows):
        rows = [row | {"program": planted(row["program"], mark)} for row in rows]
        if hashes in ("stale sums", "stale"):
            return rows
        return [row | {"program_sha256": text_sha256(row["program"])} for row in rows]

    rewrite_rendered(copy, plant)
    if hashes == "stale sums":
        (copy / "SHA256SUMS").write_bytes(sums)
    if hashes == "all fixed up":
        for path in sorted(copy.glob("data/recipes/*.arrow")):
            rendered = copy / "data/tiny" / path.name
            own = {row["id"]: row["program_sha256"] for row in rows_of(rendered)}
            rewrite(
                path,
                lambda rows, own=own: [
                    row | {"program_sha256": own[row["id"]]} for row in rows
                ],
                features=recipe_features(),
            )
    findings = verify_release(copy, resimulate=9)
    for name in ("p0000", "p0001"):
        assert any(f"{name}: its " in text for text in findings), findings
    assert not mark.exists()


def test_what_is_planted_into_a_program_would_run(simulated, tmp_path):
    mark = tmp_path / "was here"
    row, *_ = rows_of(simulated / TEST_SHARD)
    run(planted(row["program"], mark), 1, trusted=True).expect()
    assert mark.exists()


def test_rows_of_the_manifest_and_of_the_recipes_are_the_same_fields(make_row):
    row = make_row("p0000", "train", "program")
    assert list(asdict(row)) == list(recipe_features())


def test_a_folder_that_is_no_release_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        verify_release(tmp_path)


def test_an_unreadable_list_of_checksums_is_a_finding(copy):
    (copy / "SHA256SUMS").write_text("nonsense\n")
    assert "unreadable line 'nonsense'" in verify_release(copy)[0]
