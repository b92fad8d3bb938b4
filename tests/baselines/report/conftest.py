"""Results of three made-up systems on four samples, and the report of them."""

from dataclasses import replace

import pytest

from mpmworlds.baselines.report.write import write_report
from mpmworlds.baselines.results import PASSED_OVER
from mpmworlds.builder.release.layout import read_record
from mpmworlds.sim.run.encode import encode_unchecked
from tests.baselines.made_results import curves_of, result, write


def best_of_two():
    """Candidates of a system: a choice, one failure, two, and one passed over."""
    first = result("p0001", 0.75, prefix=0.9, candidates=2)
    second = result("p0001", 1.0, prefix=0.5, candidates=2, candidate=1)
    yield [first, second]
    first = result("p0002", None, candidates=2)
    second = result("p0002", 0.25, prefix=0.5, candidates=2, candidate=1)
    yield [first, second]
    first = result("p0003", None, candidates=2, outcome="crash")
    second = result("p0003", None, candidates=2, candidate=1)
    yield [first, second]
    first = result("p0004", 0.5, prefix=0.5, candidates=2)
    first = replace(first, outcome=PASSED_OVER, continuation=None, curves=None)
    second = result("p0004", 1.0, prefix=0.75, candidates=2, candidate=1)
    yield [first, second]


SAND = {"p0003": ["liquid", "sand"], "p0004": ["sand"]}


def with_materials(samples):
    """The same candidates, where two samples hold sand."""
    return [
        [replace(r, materials=SAND.get(r.sample_id, r.materials)) for r in candidates]
        for candidates in samples
    ]


def alone(*goodness):
    return [[result(f"p{k:04d}", good)] for k, good in enumerate(goodness, 1)]


def write_systems(root):
    """Folders of copy_last, and of a program writer in two regimes."""
    told = {"predictor": "vlm_7b", "regime": "full_config"}
    untold = {"predictor": "vlm_7b", "regime": "no_materials"}
    return [
        write(root / "copy", with_materials(alone(0.5, 0.5, 0.5, 0.5))),
        write(root / "told", with_materials(best_of_two()), **told),
        write(root / "untold", with_materials(alone(0.5, 0.5, 0.25, 0.5)), **untold),
    ]


@pytest.fixture(scope="session")
def folders(tmp_path_factory):
    """Folders of the three systems. Read-only."""
    return write_systems(tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="session")
def report(folders, tmp_path_factory):
    """Folder of the report of the three. Read-only."""
    out = tmp_path_factory.mktemp("report")
    write_report(list(map(str, folders)), out)
    return out


@pytest.fixture(scope="session")
def clip_folders(release, corpus, tmp_path_factory):
    """Folders of two systems on the release of the tests, one with clips. Read-only."""
    root = tmp_path_factory.mktemp("clips")
    digest = read_record(release).digest("tiny")
    of = {"release_sha256": digest}
    samples = ("p0002", "p0002-n00")
    folders = []
    for name, good in (("copy_last", 0.5), ("mirror", 0.75)):
        curves = {"curves": curves_of(good, frames=2)}
        results = [[result(sample, good, **curves)] for sample in samples]
        folders.append(write(root / name, results, predictor=name, **of))
    clips = root / "mirror" / "clips"
    clips.mkdir()
    for sample in samples:
        mirrored = corpus.frames[sample][6:, :, ::-1]
        (clips / f"{sample}.mp4").write_bytes(encode_unchecked(mirrored, 2))
    return folders


@pytest.fixture(scope="session")
def clip_report(clip_folders, release, tmp_path_factory):
    """Folder of the report of the two, with references. Read-only."""
    out = tmp_path_factory.mktemp("clip-report")
    write_report(list(map(str, clip_folders)), out, release)
    return out
