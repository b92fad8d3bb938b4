"""A tiny pipeline and a release of small clips with real scenes."""

import dataclasses
import hashlib
from pathlib import Path

import pytest

from mpmworlds.builder.plan.manifest import write_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.store import Store

SEEDS = Path(__file__).resolve().parents[3] / "builder" / "seeds"
SPLITS = {"p0000": "train", "p0000-n00": "train", "p0001": "train", "p0002": "test"}
FRAMES = 16  # 2 a second: 6 of the prefix


@pytest.fixture(scope="session")
def pipeline(tmp_path_factory):
    """Folder of a random pipeline. Read-only."""
    from tests.baselines.vdm.tiny import save_pipeline

    folder = tmp_path_factory.mktemp("pipeline") / "tiny-vace"
    save_pipeline(folder)
    return folder


@pytest.fixture(scope="session")
def clips(make_program, make_row, run_inline, tmp_path_factory):
    """Folder of a release: squares that move, with scenes of seeds. Read-only."""
    root = tmp_path_factory.mktemp("clips")
    store = Store(root / "store")
    scenes = sorted(SEEDS.glob("*.yaml"))
    rows = []
    for number, (name, split) in enumerate(SPLITS.items()):
        program = make_program(number, size=32, frames=FRAMES)
        store.put(program, run_inline(program), framerate=2)
        scene = scenes[number].read_text("utf-8")
        told = {
            "scene": scene,
            "scene_sha256": hashlib.sha256(scene.encode()).hexdigest(),
        }
        rows.append(dataclasses.replace(make_row(name, split, program), **told))
    manifest = root / "manifest.parquet"
    write_manifest(manifest, rows)
    out = root / "mpmworlds"
    planned = Corpus(manifest, {"tiny": None}, rows_per_shard=4)
    build_release([planned], store, out, version="1.0.0")
    return out


@pytest.fixture(autouse=True)
def _offline(monkeypatch):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
