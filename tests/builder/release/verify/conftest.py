"""Small releases of simulated samples."""

import shutil
from dataclasses import replace

import pytest

from mpmworlds.builder.plan.manifest import text_sha256, write_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.store import Store
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from tests.builder.release.verify.damage import CONFIGS, SAMPLES, SCENE


@pytest.fixture(scope="session")
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
