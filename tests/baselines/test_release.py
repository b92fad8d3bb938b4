"""The loop on a release as it lies on a disk: shards, videos, checksums, programs."""

import json
from dataclasses import replace

import numpy as np
import pytest

from mpmworlds.baselines.evaluate import evaluate
from mpmworlds.baselines.results import ResultsError, read_results
from mpmworlds.builder.plan.manifest import ManifestRow, text_sha256, write_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.layout import read_record
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.store import Store
from mpmworlds.files.checksums import ChecksumError
from tests.planted import planted

# A stand-in for a simulation: a square that moves right, 44 frames of 64 px at 15 / s.
PROGRAM = """
import numpy as np


def frames():
    for t in range(44):
        frame = np.zeros((64, 64, 3), np.uint8)
        frame[{top} : {top} + 9, t : t + 9] = (0xF5, 0x2D, 0x2C)
        yield frame
"""
IDS = ("p0001", "p0001-n01", "p0002")


def sample(number, sample_id):
    program = PROGRAM.format(top=10 * number)
    scene = f"scene: {number}\n"
    row = ManifestRow(
        id=sample_id,
        kind="perturbation" if "-n" in sample_id else "parent",
        parent_id=sample_id[:5] if "-n" in sample_id else "",
        family_id=sample_id[:5],
        seeds=("square",),
        edit="",
        split="test",
        scene=scene,
        materials=("elastic", "sand")[: number + 1],
        object_types=("dynamic_body",),
        num_objects=1,
        num_materials=min(number + 1, 2),
        motion=None,
        ceiling=None,
        scene_sha256=text_sha256(scene),
        program_sha256=text_sha256(program),
    )
    return row, program


@pytest.fixture(scope="module")
def release(tmp_path_factory):
    return release_of(tmp_path_factory.mktemp("corpus"))


def release_of(folder, change=lambda program: program):
    """Release of the samples, whose programs are changed after they were drawn."""
    store = Store(folder / "store")
    rows = []
    for number, sample_id in enumerate(IDS):
        row, program = sample(number, sample_id)
        names = {}
        exec(program, names)
        program = change(program)
        store.put(program, np.stack(list(names["frames"]())), 15)
        rows.append(replace(row, program_sha256=text_sha256(program)))
    write_manifest(folder / "manifest.parquet", rows)
    out = folder / "release"
    planned = Corpus(folder / "manifest.parquet", {"tiny": None})
    build_release([planned], store, out, version="1.0.0")
    return out


def run(release, predictor, out, **options):
    path = evaluate(release, predictor, "test", out, progress=False, **options)
    return json.loads(path.read_text())


def test_oracle_is_perfect_on_every_sample(release, tmp_path):
    summary = run(release, "oracle", tmp_path)
    assert summary["outcomes"] == {"ok": 3}
    for part in ("prefix", "continuation"):
        means = {name: m["valid"]["mean"] for name, m in summary[part].items()}
        assert means["mask_iou"] == 1
        assert means["mse"] == means["color_tv"] == means["semd"] == means["wmae"] == 0


def test_programs_of_a_release_do_nothing_but_draw(tmp_path):
    mark = tmp_path / "was here"
    tampered = release_of(tmp_path, lambda program: planted(program, mark))
    summary = run(tampered, "oracle", tmp_path / "out")
    assert summary["outcomes"] == {"ok": 3}
    assert summary["continuation"]["mask_iou"]["valid"]["mean"] == 1
    assert not mark.exists()


def test_copying_beats_nothing_and_loses_to_the_oracle(release, tmp_path):
    overlap = [
        run(release, name, tmp_path / name)["continuation"]["mask_iou"]["valid"]["mean"]
        for name in ("black", "copy_last", "oracle")
    ]
    assert overlap[0] == 0 < overlap[1] < overlap[2] == 1


def test_summary_says_what_was_evaluated(release, tmp_path):
    summary = run(release, "copy_last", tmp_path)
    digest = read_record(release).digest("tiny")
    assert summary["provenance"]["release_sha256"] == digest
    assert summary["samples"] == 3
    assert summary["continuation"]["mse"]["valid"]["families"] == 2
    assert list(summary["slices"]["material_family"]) == ["elastic/plastic", "sand"]
    assert list(summary["slices"]["object_type"]) == ["dynamic_body"]
    assert "copy_last on tiny/test" in (tmp_path / "summary.txt").read_text()


def test_limited_evaluation_can_be_extended(release, tmp_path):
    assert run(release, "copy_last", tmp_path / "a", limit=1)["samples"] == 1
    whole = run(release, "copy_last", tmp_path / "a")
    assert whole == run(release, "copy_last", tmp_path / "b")
    _, results = read_results(tmp_path / "a" / "results.jsonl")
    assert [result.sample_id for result in results] == list(IDS)


def test_other_predictor_does_not_mix_into_the_folder(release, tmp_path):
    run(release, "copy_last", tmp_path, limit=1)
    with pytest.raises(ResultsError, match="predictor = 'copy_last', must be 'black'"):
        run(release, "black", tmp_path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"predictor": "nobody"}, "'nobody': unknown"),
        ({"config": "huge"}, "has no configuration 'huge'"),
        ({"limit": 0}, "limit = 0, must be at least 1"),
        ({"retries": -1}, r"retries = -1 \(--retry-failed\), must be at least 0"),
    ],
)
def test_impossible_request_is_an_error(release, tmp_path, arguments, message):
    with pytest.raises(ValueError, match=message):
        run(release, **{"predictor": "black", "out": tmp_path} | arguments)
    assert list(tmp_path.iterdir()) == []


def test_damaged_shard_is_not_evaluated(release, tmp_path):
    copy = tmp_path / "release"
    for path in release.rglob("*"):
        if path.is_file():
            target = copy / path.relative_to(release)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    (shard,) = (copy / "data" / "tiny").glob("test-*.arrow")
    data = bytearray(shard.read_bytes())
    data[len(data) // 2] ^= 1
    shard.write_bytes(data)
    with pytest.raises(ChecksumError, match="sha256"):
        run(copy, "black", tmp_path / "out")
