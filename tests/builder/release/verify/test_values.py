"""Wrong values of rows are found though all else agrees with them."""

import shutil

import pytest

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.release.checks import shard as shard_check
from mpmworlds.builder.release.features import features_of, recipe_features
from mpmworlds.files.checksums import write_checksums
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene
from tests.builder.release.verify.damage import (
    RECIPES,
    SCENE,
    TEST,
    TRAIN,
    backwards,
    black,
    changed,
    findings_of,
    fix_up,
    found,
    remade,
    rewrite,
    rows_of,
    same,
    write_rows,
)

NO_VIDEO = {"bytes": b"x", "path": "p0001.mp4"}


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
