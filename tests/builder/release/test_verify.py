"""Whatever is wrong with a release is found; nothing is found where nothing is."""

import hashlib
import shutil
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from mpmworlds.builder.parameters import Parameters
from mpmworlds.builder.plan.manifest import (
    read_table,
    recorded_manifest,
    text_sha256,
    write_manifest,
)
from mpmworlds.builder.release import verify
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.checks import shard as shard_check
from mpmworlds.builder.release.checks import values
from mpmworlds.builder.release.features import features_of, recipe_features
from mpmworlds.builder.release.layout import (
    Batch,
    Record,
    index_bytes,
    index_path,
    read_record,
)
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.release.verify import verify_release
from mpmworlds.builder.render.store import Store
from mpmworlds.files.checksums import write_checksums
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4, frames_sha256
from mpmworlds.sim.run.preview import encode_preview, poster
from mpmworlds.sim.run.run import Outcome, run
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.recorded_lists import read_lists, write_lists
from tests.planted import planted

SCENE = """
schema: mpmworlds-scene/1
simulation: {{grid_resolution: 32, time_step_dt: 1.0e-4, substeps_per_frame: 40,
             duration_frames: 4, particles_per_cell: 4, seed: 7}}
objects:
- name: object_0
  object_type: dynamic_body
  shape: {{type: box, center: [0.5, 0.5], size: [0.3, 0.3]}}
  physics_properties: {{constitutive_model: elastic, density: 1000.0,
                       youngs_modulus: 5.0e+4, poissons_ratio: 0.2}}
  initial_state: {{velocity: [4.0, 0.0]}}
  visualization: {{color: '{color}'}}
output: {{resolution: 64, framerate: 30}}
"""
SAMPLES = {
    "s00": ("train", PALETTE["red"]),
    "p0000": ("train", PALETTE["green"]),
    "p0001": ("test", PALETTE["sky"]),
}
CONFIGS = {"full": None, "full-clips": None, "preview": None}


@pytest.fixture(scope="module")
def simulated(tmp_path_factory, make_row):
    """Folder of a small release of simulated samples. Read-only."""
    root = tmp_path_factory.mktemp("simulated")
    store, rows = Store(root / "store"), []
    for sample_id, (split, color) in SAMPLES.items():
        scene = Scene.from_yaml(SCENE.format(color=color))
        program, text = link(scene), scene.to_yaml()
        store.put(program, run(program).expect(), scene.output.framerate)
        is_seed = sample_id.startswith("s")
        rows.append(
            replace(
                make_row(sample_id, split, program),
                kind="seed" if is_seed else "parent",
                edit="" if is_seed else '{"operator": "compose"}',
                scene=text,
                scene_sha256=text_sha256(text),
                materials=("elastic",),
                num_objects=1,
            )
        )
    write_manifest(root / "manifest.parquet", rows)
    out = root / "mpmworlds"
    planned = Corpus(
        root / "manifest.parquet",
        CONFIGS,
        lists={"evaluation_test": ["p0001"]},
        rows_per_shard=1,
    )
    build_release([planned], store, out, version="1.0.0")
    return out


@pytest.fixture
def copy(simulated, tmp_path):
    return shutil.copytree(simulated, tmp_path / "copy")


TEST = "data/full/test-00000-of-00001.arrow"
TRAIN = [f"data/full/train-0000{number}-of-00002.arrow" for number in range(2)]
RECIPES = "data/recipes/test-00000-of-00001.arrow"


def findings_of(release, resimulate=0, **options):
    """Return the findings, one line each."""
    found = verify_release(release, resimulate=resimulate, **options)
    return [str(finding) for finding in found.findings]


def rows_of(path):
    with pa.OSFile(str(path), "rb") as file:
        return pa.ipc.open_stream(file).read_all().to_pylist()


def config_of(path):
    return Path(path).parent.name


def write_rows(path, rows, features=None):
    schema = (features or features_of(config_of(path))).arrow_schema
    with (
        pa.OSFile(str(path), "wb") as file,
        pa.ipc.new_stream(file, schema) as writer,
    ):
        writer.write_table(pa.Table.from_pylist(rows, schema=schema))


def batches_of(path):
    """Return where the record batches of a file lie."""
    found = []
    with pa.memory_map(str(path)) as source:
        schema = pa.ipc.read_schema(source)
        while True:
            start = source.tell()
            try:
                message = pa.ipc.read_message(source)
            except EOFError:
                return found
            rows, size = pa.ipc.read_record_batch(message, schema), source.tell()
            data = path.read_bytes()[start:size]
            ids = tuple(map(str, rows.column("id").to_pylist()))
            digest = hashlib.sha256(data).digest()
            found.append(Batch(start, size - start, digest, ids))


def fix_up(copy):
    """Make all say what the files of rows hold: record, indexes, card and checksums."""
    before = read_record(copy)
    configs = {}
    for name, config in before.configs.items():
        files = []
        for file in config.files:
            path = copy / file.path
            changes = {
                "size": path.stat().st_size,
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
                "rows": len(rows_of(path)),
            }
            files.append(file.model_copy(update=changes))
        parts = [(file, batches_of(copy / file.path)) for file in files]
        index = index_bytes(features_of(name).arrow_schema, parts)
        (copy / index_path(name)).write_bytes(index)
        configs[name] = config.model_copy(update={"files": files})
    record = before.model_copy(update={"configs": configs})
    (copy / "release.json").write_text(record.text())
    card = (copy / "README.md").read_text()
    for name in configs:
        card = card.replace(before.digest(name), record.digest(name))
    (copy / "README.md").write_text(card)
    write_checksums(copy)


def rewrite(copy, name, change):
    """Change the rows of a file and make everything else say the same again."""
    write_rows(copy / name, change(rows_of(copy / name)))
    fix_up(copy)


def changed(**values):
    return lambda rows: [row | values for row in rows]


def found(findings, name, text):
    """Whether a finding names a file, and says something."""
    return any(line.startswith(name) and text in line for line in findings)


def test_a_release_as_it_was_built_has_no_findings(simulated):
    verified = verify_release(simulated, resimulate=3)
    assert verified.findings == ()
    assert sorted(s.id for s in verified.simulated) == sorted(SAMPLES)
    assert {s.tier for s in verified.simulated} == {"exact"}


def test_a_release_that_was_fixed_up_has_no_findings(copy):
    before = (copy / "SHA256SUMS").read_bytes()
    fix_up(copy)
    assert (copy / "SHA256SUMS").read_bytes() == before
    rewrite(copy, TEST, lambda rows: rows)
    assert findings_of(copy) == []


# ---- files


def test_a_flipped_bit_is_found(copy):
    data = bytearray((copy / TEST).read_bytes())
    data[-300] ^= 1
    (copy / TEST).write_bytes(data)
    findings = findings_of(copy)
    assert found(findings, TEST, "its sha256 is not the one in SHA256SUMS; fetch")
    assert found(findings, TEST, "its sha256 is not the one in release.json; fetch")


def test_a_truncated_shard_is_found(copy):
    data = (copy / TEST).read_bytes()
    (copy / TEST).write_bytes(data[: len(data) // 2])
    assert found(findings_of(copy), TEST, "cannot be read")


@pytest.mark.parametrize("begin", [b"", b"\xff" * 99, b"ARROW1\0\0", bytes(64)])
def test_a_shard_of_anything_is_found(copy, begin):
    (copy / TEST).write_bytes(begin)
    assert found(findings_of(copy), TEST, "cannot be read")


def test_text_that_is_none_is_found_beside_the_checksum(copy):
    data = (copy / TEST).read_bytes()
    place = data.index(b"mpmworlds-scene/1")
    (copy / TEST).write_bytes(data[:place] + b"\xff" + data[place + 1 :])
    findings = findings_of(copy)
    assert found(findings, TEST, "its sha256 is not the one in SHA256SUMS")
    assert found(findings, TEST, "cannot be read (In column 7: Invalid: Invalid UTF8")


def test_missing_and_extra_files_are_found(copy):
    (copy / TEST).unlink()
    extra = "data/full/extra-00000-of-00001.arrow"
    (copy / extra).write_bytes(b"")
    shutil.copy(copy / RECIPES, copy / "rows.arrow")
    findings = findings_of(copy)
    assert found(findings, TEST, "is missing, SHA256SUMS names it")
    for name in (extra, "rows.arrow"):
        assert found(findings, name, "SHA256SUMS does not name it; take it away")
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, TEST, "is missing, release.json names it")
    assert found(findings, "data/full: p0001: ", "is missing, the lists say")
    for name in (extra, "rows.arrow"):
        assert found(findings, name, "release.json does not name it; take it away")


@pytest.mark.parametrize("name", ["README.md", "release.json", "splits/test.txt"])
def test_a_missing_part_is_found(copy, name):
    (copy / name).unlink()
    assert found(findings_of(copy), name, "is missing")
    write_checksums(copy)
    assert any("missing" in line for line in findings_of(copy))


@pytest.mark.parametrize(
    "sums", [b"nonsense\n", b"\xff\xfe\x00", b"\x1b[2J" * 5000, b"0" * 64 + b"  \xff"]
)
def test_an_unreadable_list_of_checksums_is_a_finding(copy, sums):
    (copy / "SHA256SUMS").write_bytes(sums)
    findings = findings_of(copy)
    assert findings
    assert all(line.isprintable() and len(line) < 1500 for line in findings)


@pytest.mark.parametrize(
    "record",
    [
        b"",
        b"\xff",
        b"[" * 100_000,
        b'{"dataset": "mpmworlds", "version": "\x1b[2J"}',
        b'{"dataset": "mpmworlds", "version": 3}',
    ],
)
def test_an_absurd_record_is_a_finding(copy, record):
    (copy / "release.json").write_bytes(record)
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, "release.json", "; ")
    assert all(line.isprintable() and len(line) < 1500 for line in findings)


def test_a_record_of_paths_elsewhere_is_a_finding(copy):
    text = (copy / "release.json").read_text()
    (copy / "release.json").write_text(text.replace(TEST, "../../../etc/passwd"))
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, "../../../etc/passwd", "is missing, release.json names it")
    assert found(findings, TEST, "release.json does not name it")


def edited(copy, change):
    """Change the record, and make the checksums right again."""
    record = read_record(copy).model_dump()
    change(record)
    (copy / "release.json").write_text(Record(**record).text())
    write_checksums(copy)


@pytest.mark.parametrize(
    ("key", "value", "fault"),
    [
        ("rows", 7, "has 1 rows, release.json says 7"),
        ("size", 7, "bytes, release.json says 7"),
        ("sha256", "0" * 64, "its sha256 is not the one in release.json"),
    ],
)
def test_a_record_that_says_something_else_of_a_file_is_found(copy, key, value, fault):
    edited(
        copy, lambda record: record["configs"]["full"]["files"][2].update({key: value})
    )
    assert found(findings_of(copy), TEST, fault)


def test_another_order_of_files_and_another_version_are_found(copy):
    edited(copy, lambda record: record["configs"]["full"]["files"].reverse())
    assert found(
        findings_of(copy), "release.json", "files of full must be data/full/tr"
    )
    edited(copy, lambda record: record.update(version="9.9.9"))
    assert found(findings_of(copy), "README.md", "full: version is '1.0.0', must be '9")


@pytest.mark.parametrize("data", [b"", b"\xff" * 100, "other", "recipes"])
def test_an_absurd_index_is_found(copy, data):
    path = "data/full/index.arrow"
    if data == "other":
        table = pa.table({"path": ["x"], "sha256": ["y"]})
        sink = pa.BufferOutputStream()
        with pa.ipc.new_stream(sink, table.schema) as writer:
            writer.write_table(table)
        data = bytes(sink.getvalue())
    if data == "recipes":
        data = (copy / "data/recipes/index.arrow").read_bytes()
    (copy / path).write_bytes(data)
    write_checksums(copy)
    assert found(findings_of(copy), path, "")


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"offset": 8}, "batch 2, in data/full/test-00000-of-00001.arrow: offset = 8"),
        ({"sha256": bytes(32)}, "its bytes are not those that the sha256 names"),
        ({"ids": ("p0009",)}, "ids = ['p0009'], is ['p0001']"),
    ],
)
def test_an_index_that_leads_elsewhere_is_found(copy, change, fault):
    files = read_record(copy).configs["full"].files
    parts = [(file, batches_of(copy / file.path)) for file in files]
    (batch,) = parts[2][1]
    parts[2] = (files[2], [replace(batch, **change)])
    path = index_path("full")
    (copy / path).write_bytes(index_bytes(features_of("full").arrow_schema, parts))
    write_checksums(copy)
    findings = findings_of(copy)
    assert len(findings) == 1
    assert found(findings, path, fault)


@pytest.mark.parametrize(
    ("before", "after", "fault"),
    [
        ("license: cc-by-4.0", "license: [", "its header is no YAML"),
        ("---\n", "", "has no header of YAML"),
        ("num_examples: 1", "num_examples: 5", "num_examples is 5, the record says 1"),
        ("content sha256:", "content sha256:0", "description is 'content sha256:0"),
        ("dtype: int32", "dtype: int64", "full: its features are not the columns of"),
        ("dtype: int32", "dtype: [3]", "full: its features are not the columns of"),
        ("features:\n", "features: 3\n  old:\n", "full: its features are not the col"),
        ("config_name: preview", "config_name: prview", "'prview' is only in the card"),
        ("data/full/test-*", "data/full/train-*", "full: data_files is"),
        ("- config_name: full\n", "- config_name:\n", "'full' is only in the record"),
    ],
)
def test_a_wrong_card_is_found(copy, before, after, fault):
    text = (copy / "README.md").read_text()
    assert before in text
    (copy / "README.md").write_text(text.replace(before, after))
    write_checksums(copy)
    assert found(findings_of(copy), "README.md", fault)


@pytest.mark.parametrize("data", [b"\xff---\n", b"---\n- 3\n---\n", b"---\n{" * 9999])
def test_an_absurd_card_is_found(copy, data):
    (copy / "README.md").write_bytes(data)
    write_checksums(copy)
    assert found(findings_of(copy), "README.md", "")


def test_a_folder_that_is_no_release_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        verify_release(tmp_path)


# ---- rows that are there twice, not at all, or elsewhere


@pytest.mark.parametrize("sums", ["stale", "fixed up"])
@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda rows: rows * 2, "is there twice, also in"),
        (lambda rows: [], "is missing, the lists say that it is of test"),
    ],
)
def test_rows_that_are_dropped_or_doubled_are_found(copy, change, fault, sums):
    write_rows(copy / TEST, change(rows_of(copy / TEST)))
    if sums == "fixed up":
        fix_up(copy)
    findings = findings_of(copy)
    assert any("p0001: " in line and fault in line for line in findings), findings


def test_a_configuration_that_has_lost_all_files_is_found(copy):
    for path in (copy / "data/full-clips").glob("t*.arrow"):
        path.unlink()
    edited(copy, lambda record: record["configs"]["full-clips"].update(files=[]))
    findings = findings_of(copy)
    assert found(findings, "data/full-clips: p0001: ", "is missing, the lists say")


def swap(copy, one, other):
    first, second = (copy / one).read_bytes(), (copy / other).read_bytes()
    (copy / one).write_bytes(second)
    (copy / other).write_bytes(first)


@pytest.mark.parametrize("sums", ["stale", "fixed up"])
@pytest.mark.parametrize("config", ["full", "full-clips", "preview", "recipes"])
def test_swapped_files_of_two_splits_are_found(copy, config, sums):
    one, other = TEST, TRAIN[1]
    if config == "recipes":
        other = "data/recipes/train-00000-of-00001.arrow"
    one, other = (Path("data", config, Path(name).name) for name in (one, other))
    swap(copy, one, other)
    if sums == "fixed up":
        fix_up(copy)
    findings = findings_of(copy)
    assert found(findings, f"{one}: p0000", "split = 'train', in a file of 'test'")
    assert found(findings, f"{other}: p0001", "split = 'test', in a file of 'train'")


def test_swapped_files_of_a_split_are_found(copy):
    swap(copy, *TRAIN)
    findings = findings_of(copy)
    for name in TRAIN:
        assert found(findings, name, "its sha256 is not the one in")
    fix_up(copy)
    (finding,) = findings_of(copy)
    assert finding == (
        f"{TRAIN[1]}: s00: comes later than in recipes; rows or files were swapped; "
        "fetch or build the release again"
    )


# ---- values

NO_VIDEO = {"bytes": b"x", "path": "p0001.mp4"}


def media(frames, rate=30):
    """Return the columns of a video, all of them in agreement."""
    clip = encode_mp4(reduce_clip(frames, rate), min(rate, 15))
    return {
        "video": {"bytes": encode_mp4(frames, rate), "path": "p0001.mp4"},
        "clip": {"bytes": clip, "path": "p0001.clip.mp4"},
        "frames_sha256": frames_sha256(frames),
        "num_frames": len(frames),
    }


def remade(change, *, only=("video", "clip", "frames_sha256"), rate=30):
    """Return a change of rows that changes their frames, and some of the columns."""

    def remake(rows):
        made = []
        for row in rows:
            columns = media(change(decode_mp4(row["video"]["bytes"])), rate)
            made.append(row | {name: columns[name] for name in only})
        return made

    return remake


def black(frames):
    return np.zeros_like(frames)


def same(frames):
    return frames


def backwards(frames):
    return frames[::-1]


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (changed(id="p0007"), "video: path = 'p0001.mp4', must be its id and '.mp4'"),
        (changed(id="../../x"), "sample id '../../x': must be a parent"),
        (changed(kind="seed"), "kind = 'seed', its id says 'parent'"),
        (changed(parent_id="p0000"), "parent_id = 'p0000', its id says ''"),
        (changed(family_id="p0000"), "family_id = 'p0000', its id says 'p0001'"),
        (changed(edit=""), "edit = '', must be a JSON object"),
        (changed(split="train"), "split = 'train', in a file of 'test'"),
        (changed(scene="scene"), "its scene is not the one that scene_sha256 names"),
        (changed(scene="scene"), "its scene is not valid: "),
        (changed(materials=["sand"]), "materials = ['sand'], its scene says ['elastic"),
        (changed(object_types=[]), "object_types = [], its scene says ['dynamic_bod"),
        (changed(num_objects=2), "num_objects = 2, its scene says 1"),
        (changed(num_materials=2), "num_materials = 2, its scene says 1"),
        (changed(seeds=["other"]), "its recipe (id to program_sha256) is not that of "),
        (changed(motion=0.5), "its recipe (id to program_sha256) is not that of "),
        (changed(framerate=15), "framerate = 15, its scene says 30"),
        (changed(resolution=128), "resolution = 128, its scene says 64"),
        (changed(num_frames=3), "num_frames = 3, its scene says 4"),
        (changed(program="pass"), "its program is not the one that program_sha256"),
        (changed(program_sha256="0"), "its scene links to another program than"),
        (changed(frames_sha256="0"), "its video does not hold the frames that frames"),
        (changed(frames_sha256="0"), "its frames_sha256 is not the one in data/full/"),
        (changed(video=NO_VIDEO), "its video: 1 bytes hold no decodable video"),
        (changed(clip={"bytes": b"x", "path": "p0001.clip.mp4"}), "its clip: 1 bytes"),
        (remade(black, only=["video"]), "its video does not hold the frames that fra"),
        (remade(black, only=["clip"]), "its clip is not its video reduced"),
        (remade(black, only=["clip"]), "its clip is not the one in data/full/test"),
        (remade(backwards, only=["video"]), "its video does not hold the frames th"),
        (remade(same, rate=20), "its video: has 20 frames per second, must have 30"),
        (
            remade(lambda frames: frames[:2], only=["video"]),
            "its video: is (2, 64, 64)",
        ),
        (remade(lambda frames: frames[:, :32, :32]), "its video: is (4, 32, 32) (fra"),
    ],
)
def test_a_wrong_row_is_found_though_all_else_agrees_with_it(copy, change, fault):
    rewrite(copy, TEST, change)
    findings = findings_of(copy)
    assert any("p0001" in line and fault in line for line in findings) or any(
        fault in line for line in findings if "../../x" in line or "p0007" in line
    ), findings


@pytest.mark.parametrize("config", ["full", "full-clips", "preview", "recipes"])
def test_a_null_is_found(copy, config):
    name = TEST.replace("full", config)
    for column in ["id", "scene", "materials", "num_objects", "edit"]:
        shutil.copy(copy / name, copy / "kept")
        rewrite(copy, name, changed(**{column: None}))
        assert any(f"{column}: is null" in line for line in findings_of(copy)), column
        shutil.move(copy / "kept", copy / name)


@pytest.mark.parametrize("column", ["video", "clip"])
@pytest.mark.parametrize("value", [None, {"bytes": None, "path": "p0001.mp4"}])
def test_no_video_at_all_is_found(copy, column, value):
    rewrite(copy, TEST, changed(**{column: value}))
    assert found(findings_of(copy), f"{TEST}: p0001", f"{column}: is null")


def test_materials_that_are_edited_everywhere_are_found(copy):
    for path in sorted(copy.glob("data/*/test-*.arrow")):
        write_rows(path, changed(materials=["sand"])(rows_of(path)))
    fix_up(copy)
    findings = findings_of(copy)
    for config in ("full", "full-clips", "preview", "recipes"):
        name = TEST.replace("full", config, 1)
        assert found(findings, f"{name}: p0001", "materials = ['sand'], its scene says")


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (changed(scene="a: 1\n"), "its scene is not the one that scene_sha256"),
        (changed(scene="a: 1\n"), "its scene is not valid: "),
        (changed(scene="a: " + "[" * 100_000), "its scene is not valid: "),
        (changed(program_sha256="0"), "its scene links to another program"),
    ],
)
def test_a_wrong_recipe_is_found(copy, change, fault):
    rewrite(copy, RECIPES, change)
    assert found(findings_of(copy), f"{RECIPES}: p0001", fault)


def test_a_recipe_that_is_not_that_of_the_rendered_row_is_found(copy):
    rewrite(copy, RECIPES, changed(edit="{}"))
    assert found(findings_of(copy), f"{TEST}: p0001", "its recipe (id to program_sha")


@pytest.mark.parametrize("config", ["full-clips", "preview"])
def test_a_twin_or_a_preview_of_something_else_is_found(copy, config):
    name = TEST.replace("full", config, 1)
    other = TRAIN[0].replace("full", config, 1)
    (row,), columns = rows_of(copy / other), features_of(config)
    kept = {c: row[c] for c in columns if c not in recipe_features()}
    names = {
        c: v | {"path": v["path"].replace("s00", "p0001")}
        for c, v in kept.items()
        if isinstance(v, dict)
    }
    rewrite(copy, name, changed(**(kept | names)))
    findings = findings_of(copy)
    if config == "preview":
        assert found(findings, f"{name}: p0001", "its preview is up to")
        assert found(findings, f"{name}: p0001", "its poster is no frame of its clip")
    else:
        assert found(findings, f"{name}: p0001", "its clip is not the one in data/full")


@pytest.mark.parametrize("column", ["preview", "poster"])
@pytest.mark.parametrize(
    "damage", [lambda data: data[: len(data) // 2], lambda data: b"no"]
)
def test_a_preview_that_cannot_be_decoded_is_found(copy, column, damage):
    def harm(rows):
        return [
            row | {column: row[column] | {"bytes": damage(row[column]["bytes"])}}
            for row in rows
        ]

    name = TEST.replace("full", "preview", 1)
    rewrite(copy, name, harm)
    assert found(findings_of(copy), f"{name}: p0001", f"its {column}: ")


def test_texts_of_a_release_are_escaped_and_cut(copy):
    rewrite(copy, TEST, changed(id="\x1b[2J" + "x" * 100_000, kind="\x9b" * 99_999))
    findings = findings_of(copy)
    assert found(findings, f"{TEST}: \\x1b[2J", "sample id ")
    assert all(line.isprintable() and len(line) < 1500 for line in findings)


def linked(monkeypatch, copy, rows_of_a_file):
    """Return the findings on a recipe that says it links to another program."""
    monkeypatch.setattr(shard_check, "LINKED", rows_of_a_file)
    rewrite(copy, RECIPES, changed(program_sha256="0" * 64))
    return found(findings_of(copy), RECIPES, "its scene links to")


def test_of_many_recipes_some_are_linked(monkeypatch, copy):
    assert linked(monkeypatch, copy, rows_of_a_file=1)
    assert not linked(monkeypatch, copy, rows_of_a_file=0)


def test_of_rendered_rows_all_are_linked(monkeypatch, copy):
    monkeypatch.setattr(shard_check, "LINKED", 0)
    other = Scene.from_yaml(SCENE.format(color=PALETTE["green"])).to_yaml()
    rewrite(copy, TEST, changed(scene=other, scene_sha256=text_sha256(other)))
    assert found(findings_of(copy), TEST, "its scene links to")


def test_several_processes_find_the_same(copy):
    rewrite(copy, TEST, changed(frames_sha256="0"))
    findings = findings_of(copy, workers=2)
    assert findings == findings_of(copy)
    assert findings


def test_other_columns_are_found(copy):
    rows = [
        {name: row[name] for name in recipe_features()} for row in rows_of(copy / TEST)
    ]
    write_rows(copy / TEST, rows, features=recipe_features())
    write_checksums(copy)
    assert found(findings_of(copy), TEST, "its columns or their types are not those of")


def test_videos_are_not_decoded_if_that_is_not_wanted(copy):
    rewrite(copy, TEST, changed(video=NO_VIDEO))
    assert findings_of(copy, videos=False) == []
    assert findings_of(copy, videos=True)


# ---- lists


def test_a_list_that_differs_from_the_rows_is_found(copy):
    lists = read_lists(copy / "splits")
    moved = {"test": ["p0000"], "train": ["p0001", "s00"], "evaluation_test": ["p0009"]}
    write_lists(copy / "splits", lists | moved)
    write_checksums(copy)
    findings = findings_of(copy)
    for config in ("full", "full-clips", "recipes"):
        start = f"data/{config}: p0000"
        assert found(findings, start, "is missing, the lists say that it is of test")
    assert found(findings, f"{TEST}: p0001", "is there, but in no list of full and te")
    name = "splits/evaluation_test.txt"
    assert found(findings, name, "p0009 is in no row of recipes")


def test_lists_that_cannot_be_read_are_found(copy):
    (copy / "splits/test.txt").write_bytes(b"\xff\x1b[2J")
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, "splits", "sha256")
    assert all(line.isprintable() for line in findings)


# ---- simulated again


def frames_everywhere(copy, change):
    """Put other frames into all videos of a sample, with all hashes right."""
    (row,) = rows_of(copy / TEST)
    frames = change(decode_mp4(row["video"]["bytes"]))
    reduced = reduce_clip(frames, 30)
    made = media(frames)
    made["preview"] = {
        "bytes": encode_preview(reduced, 15),
        "path": "p0001.preview.mp4",
    }
    made["poster"] = {"bytes": poster(reduced), "path": "p0001.png"}
    edit_everywhere(copy, made)


def edit_everywhere(copy, values):
    """Change columns of a sample wherever they are, with all hashes right."""
    for path in sorted(copy.glob("data/*/test-*.arrow")):
        columns = features_of(config_of(path))
        kept = {name: value for name, value in values.items() if name in columns}
        write_rows(path, changed(**kept)(rows_of(path)))
    fix_up(copy)


@pytest.mark.parametrize("change", [backwards, black])
def test_frames_that_the_program_does_not_render_are_found(copy, change):
    frames_everywhere(copy, change)
    assert findings_of(copy) == []
    (finding,) = findings_of(copy, resimulate=3)
    assert ": p0001: simulated again, it gives another video here (" in finding


def test_an_old_video_of_another_scene_and_its_program_is_found(copy):
    scene = Scene.from_yaml(SCENE.format(color=PALETTE["green"]))
    text, program = scene.to_yaml(), link(scene)
    changes = {"scene": text, "program": program}
    hashes = {f"{name}_sha256": text_sha256(value) for name, value in changes.items()}
    edit_everywhere(copy, changes | hashes)
    assert findings_of(copy) == []
    (finding,) = findings_of(copy, resimulate=3)
    assert ": p0001: simulated again, it gives another video here (" in finding


def test_rows_are_drawn_by_fresh_randomness_that_can_be_repeated(
    simulated, monkeypatch
):
    failed = Outcome("exception", np.zeros((0, 1, 1, 3), np.uint8), 0.0, "none")
    monkeypatch.setattr(verify, "run", lambda program: failed)
    drawn = [verify_release(simulated, seed=str(seed)) for seed in range(8)]
    assert len({verified.simulated[0].id for verified in drawn}) == len(SAMPLES)
    assert verify_release(simulated, seed="3") == drawn[3]
    (finding,) = drawn[3].findings
    assert "simulated again, it gives another video here (it ends in ex" in str(finding)
    first, second = (verify_release(simulated, resimulate=0) for _ in range(2))
    assert first.seed != second.seed


def test_a_row_with_findings_is_not_simulated_again(copy):
    rewrite(copy, TEST, changed(kind="child"))
    for name in TRAIN:
        with (copy / name).open("ab") as file:
            file.write(b"more")
    verified = verify_release(copy, resimulate=9)
    simulated = {found.path for found in verified.simulated}
    assert not simulated & {TEST, *TRAIN}
    assert verified.findings


@pytest.mark.parametrize("hashes", ["stale sums", "stale", "fixed up", "everywhere"])
def test_a_program_that_was_tampered_with_is_found_and_never_run(
    copy, tmp_path, hashes
):
    mark = tmp_path / "was here"
    sums = (copy / "SHA256SUMS").read_bytes()
    (row,) = rows_of(copy / TEST)
    program = planted(row["program"], mark)
    values = {"program": program}
    if hashes in ("fixed up", "everywhere"):
        values["program_sha256"] = text_sha256(program)
    if hashes == "everywhere":
        edit_everywhere(copy, values)
    else:
        rewrite(copy, TEST, changed(**values))
    if hashes == "stale sums":
        (copy / "SHA256SUMS").write_bytes(sums)
    findings = findings_of(copy, resimulate=9)
    assert found(findings, f"{TEST}: p0001: its ", "program"), findings
    assert not mark.exists()


def test_what_is_planted_into_a_program_would_run(simulated, tmp_path):
    mark = tmp_path / "was here"
    row, *_ = rows_of(simulated / TEST)
    run(planted(row["program"], mark), 1, trusted=True).expect()
    assert mark.exists()


def test_what_is_simulated_is_confined(simulated, monkeypatch):
    given = []

    def watched(program, **options):
        given.append(options)
        return run(program, **options)

    monkeypatch.setattr(verify, "run", watched)
    assert verify_release(simulated).findings == ()
    assert given == [{}]


def test_rows_of_the_manifest_and_of_the_recipes_are_the_same_fields(make_row):
    row = make_row("p0000", "train", "program")
    assert list(asdict(row)) == list(recipe_features())


# ---- the corpora of the package


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
