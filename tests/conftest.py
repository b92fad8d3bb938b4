"""A small hand-made corpus, rendered and released once for all tests that need one."""

import hashlib
import os
import shutil
import tempfile
import textwrap
from types import SimpleNamespace

import pytest
from hypothesis import settings

from mpmworlds.builder.plan.manifest import ManifestRow, write_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.store import Store
from mpmworlds.cli import main
from mpmworlds.sim.scene.palette import PALETTE, rgb
from tests.small import build_small

# A busy machine takes its time; a test that hangs is seen without deadlines.
settings.register_profile("any machine", deadline=None)
settings.load_profile("any machine")

IDS = {
    "p0000": "train",
    "p0000-c0": "train",
    "p0000-c0-n00": "train",
    "p0000-c1": "modification_validation",
    "p0001": "train",
    "p0001-n00": "train",
    "p0002": "test",
    "p0002-n00": "test",
}


def program_of(number, size=64, frames=8):
    """Return a program without physics: a square that moves right."""
    color = rgb(list(PALETTE.values())[number])
    return textwrap.dedent(
        f"""\
        import numpy as np

        def frames():
            for t in range({frames}):
                frame = np.zeros(({size}, {size}, 3), np.uint8)
                frame[20:30, {number} + 3 * t : {number} + 3 * t + 10] = {color}
                yield frame
        """
    )


def frames_of(program):
    """Run a program without physics right here."""
    import numpy as np

    names = {}
    exec(program, names)
    return np.stack(list(names["frames"]()))


def row_of(sample_id, split, program):
    """Return a manifest row around a program."""
    kind = "perturbation" if "-n" in sample_id else "child" if "-c" in sample_id else ""
    scene = f"# scene of {sample_id}\n"
    return ManifestRow(
        id=sample_id,
        kind=kind or "parent",
        parent_id=sample_id.rpartition("-")[0],
        family_id=sample_id.partition("-")[0],
        seeds=("pinwheel", "rain"),
        edit="" if not kind else '{"operator": "jitter"}',
        split=split,
        scene=scene,
        materials=("liquid", "sand") if "-c" in sample_id else ("liquid",),
        object_types=("dynamic_body",),
        num_objects=3,
        num_materials=2 if "-c" in sample_id else 1,
        motion=None,
        ceiling=None,
        scene_sha256=hashlib.sha256(scene.encode()).hexdigest(),
        program_sha256=hashlib.sha256(program.encode()).hexdigest(),
    )


@pytest.fixture(scope="session")
def make_program():
    """Function (number, size, frames) -> text of a program without physics."""
    return program_of


@pytest.fixture(scope="session")
def make_row():
    """Function (id, split, program) -> manifest row."""
    return row_of


@pytest.fixture(scope="session")
def run_inline():
    """Function program -> frames, for programs without physics."""
    return frames_of


@pytest.fixture(scope="session")
def corpus(tmp_path_factory):
    """Manifest, rows, programs, frames and store of the corpus. Not to be changed."""
    root = tmp_path_factory.mktemp("corpus")
    store = Store(root / "store")
    programs = {name: program_of(number) for number, name in enumerate(IDS)}
    frames = {name: frames_of(program) for name, program in programs.items()}
    rows = [row_of(name, split, programs[name]) for name, split in IDS.items()]
    for name, program in programs.items():
        store.put(program, frames[name], framerate=2)
    manifest = root / "manifest.parquet"
    write_manifest(manifest, rows)
    return SimpleNamespace(
        manifest=manifest, rows=rows, programs=programs, frames=frames, store=store
    )


@pytest.fixture(scope="session")
def release(corpus, tmp_path_factory):
    """Folder of a release named mpmworlds, default configuration tiny. Read-only."""
    out = tmp_path_factory.mktemp("release") / "mpmworlds"
    configs = {"tiny": None, "mini": ["p0000", "p0002"]}
    planned = Corpus(corpus.manifest, configs, rows_per_shard=2)
    build_release([planned], corpus.store, out, version="1.2.3")
    return out


@pytest.fixture(scope="session")
def two_corpora(corpus, tmp_path_factory):
    """Folder of a release of two corpora with the same ids; see below. Read-only.

    `tiny` is all of one; of the other, `full`, there are clips of p0002 and recipes.
    """
    root = tmp_path_factory.mktemp("two")
    program = program_of(len(IDS))
    corpus.store.put(program, frames_of(program), framerate=2)
    others = [row_of(name, split, program) for name, split in IDS.items()]
    write_manifest(root / "full.parquet", others)
    planned = [
        Corpus(root / "full.parquet", {"mini-clips": ["p0002"]}),
        Corpus(corpus.manifest, {"tiny": None}, name="tiny"),
    ]
    build_release(planned, corpus.store, root / "mpmworlds", version="1.2.3")
    return root / "mpmworlds"


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """Store, manifest and release of two small simulated worlds. Read-only."""
    return build_small(tmp_path_factory)


@pytest.fixture
def as_a_user():
    """A folder, of somebody who is not the superuser, whom the test becomes."""
    parent = tempfile.mkdtemp()
    superuser = os.geteuid() == 0
    if superuser:
        os.chown(parent, 54321, 54321)
        os.seteuid(54321)
    yield parent
    if superuser:
        os.seteuid(0)
    shutil.rmtree(parent)


@pytest.fixture
def command(capsys):
    """Return a function: arguments -> exit status, standard output and error."""

    def run(*arguments):
        status = main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return run
