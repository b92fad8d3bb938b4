"""Examples are those of the release, decoded when asked for."""

import shutil

import numpy as np
import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.files.checksums import ChecksumError
from mpmworlds.loaders.load import load
from mpmworlds.loaders.regimes import REGIMES


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_prefix_and_continuation_are_the_simulated_frames(corpus, release):
    examples = load(release, split="train")
    assert [e.id for e in examples] == [
        row.id for row in corpus.rows if row.split == "train"
    ]
    for example in examples:
        frames = np.concatenate([example.prefix, example.continuation])
        np.testing.assert_array_equal(frames, corpus.frames[example.id])
        assert len(example.prefix) == 6  # 2 frames a second: 0, 0.5 .. 2.5 s
        assert example.framerate == 2


def test_a_row_has_everything_but_the_video(release):
    example = load(release)[0]
    assert example.row["split"] == "test"
    assert example.row["program"].startswith("import numpy")
    assert "video" not in example.row


def test_an_example_is_told_what_its_regime_tells(release):
    (name, scene), *_ = load_seeds().items()
    for regime in REGIMES:
        example = load(release, regime=regime)[:2][1]
        example.row["scene"], example.row["id"] = scene.to_yaml(), name
        assert example.side_info == REGIMES[regime].tell(scene)
    with pytest.raises(ValueError, match="regime 'all': unknown"):
        load(release, regime="all")


def test_examples_are_a_sequence(release):
    examples = load(str(release), split="train")
    assert len(examples) == 5
    assert examples[-1].id == examples[4].id
    assert [e.id for e in examples[1:3]] == [examples[1].id, examples[2].id]
    with pytest.raises(IndexError):
        examples[5]


def test_a_name_is_a_configuration_of_the_release_in_the_variable(release, monkeypatch):
    monkeypatch.setenv("MPMWORLDS_RELEASE", str(release))
    assert [e.id for e in load("mini", split="train")] == ["p0000"]
    assert len(load("tiny", split="train")) == 5


def test_a_release_in_the_usual_place_is_found(release, tmp_path, monkeypatch):
    monkeypatch.delenv("MPMWORLDS_RELEASE", raising=False)
    (tmp_path / "release").mkdir()
    (tmp_path / "release" / "mpmworlds").symlink_to(release)
    monkeypatch.chdir(tmp_path)
    assert len(load("mini")) == 1


def test_a_variable_that_names_no_release_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("MPMWORLDS_RELEASE", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="holds no release"):
        load("tiny")


def test_a_configuration_of_a_folder_can_be_chosen(release):
    assert len(load(release, split="train", config="mini")) == 1


def test_splits_that_do_not_exist_are_answered_with_those_that_do(release):
    with pytest.raises(ValueError, match=r"no split mini/validation") as error:
        load(release, split="validation", config="mini")
    assert "mini/test, mini/train, recipes/modification_validation" in str(error.value)


@pytest.mark.parametrize("split", ["tiny", "mini", "recipes"])
def test_a_configuration_in_the_place_of_the_split_is_answered_with_where_it_goes(
    release, split
):
    with pytest.raises(ValueError, match="is the name of a configuration; the second"):
        load(str(release), split)
    told = rf"load\('{release}', split='test', config='{split}'\)"
    with pytest.raises(ValueError, match=told):
        load(release, split, streaming=True)


def test_of_a_repository_names_of_configurations_are_known_without_asking(monkeypatch):
    monkeypatch.delattr("datasets.load_dataset")
    with pytest.raises(ValueError, match=r"load\('acme/mpmworlds', split='test', conf"):
        load("acme/mpmworlds", "tiny")


def test_examples_say_what_they_are(release):
    def told(*arguments, **named):
        return repr(load(release, *arguments, **named))

    assert told() == "<Examples: 2 samples of tiny/test, regime frames_only>"
    assert (
        told("test", "mini", regime="caption")
        == "<Examples: 1 sample of mini/test, regime caption>"
    )
    ids = told(ids=["p0000", "p0000-c0"], config="tiny")
    assert ids == "<Examples: 2 samples of tiny, regime frames_only>"
    stream = load(release, "train", streaming=True)
    for some in (stream, stream.take(2), stream.skip(1)):
        assert repr(some) == (
            "<ExampleStream: samples of tiny/train, regime frames_only>"
        )
    part = repr(load(release, "train")[1:3])
    assert part == "<Examples: 2 samples of tiny/train, regime frames_only>"


def test_recipes_have_no_video(release):
    with pytest.raises(ValueError, match="p0002: has no video"):
        load(release, config="recipes")[0]


def test_a_configuration_of_something_that_is_no_folder_is_refused():
    with pytest.raises(ValueError, match="cannot be one of its"):
        load("tiny", config="mini")


def test_a_flipped_bit_is_an_error_before_the_first_example(release, tmp_path):
    copy = shutil.copytree(release, tmp_path / "copy")
    path = copy / "data/tiny/test-00000-of-00001.arrow"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)
    with pytest.raises(ChecksumError, match=r"test-00000-of-00001.arrow: its sha256"):
        load(copy)
    assert len(load(copy, split="train")) == 5


def test_what_is_worked_out_of_rows_does_not_lie_in_the_release(release, tmp_path):
    """`verify` would find it, and the next build would refuse the folder."""
    copy = tmp_path / "mpmworlds"
    shutil.copytree(release, copy)
    before = sorted(path.relative_to(copy) for path in copy.rglob("*"))
    for path in [*copy.rglob("*"), copy]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    table = load(copy, "train", "tiny").table
    found = table.filter(lambda name: name == "p0001", input_columns="id")
    assert found["id"][:] == ["p0001"]
    assert len(table.map(lambda row: {"more": len(row["id"])})) == len(table)
    assert sorted(path.relative_to(copy) for path in copy.rglob("*")) == before
    for path in [copy, *copy.rglob("*")]:
        path.chmod(0o755)
