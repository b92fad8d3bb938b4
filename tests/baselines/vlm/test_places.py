"""Checkpoints are found here or on the Hub, and told apart by what is in them."""

import shutil

import huggingface_hub.constants
import pytest

from mpmworlds.baselines.learned.notes import CheckpointError, Note, write_note
from mpmworlds.baselines.vlm.places import FAMILY, VERSION, check_trained, located


def test_a_folder_is_known_by_what_is_in_it(checkpoint, tmp_path):
    copy = shutil.copytree(checkpoint, tmp_path / "copy")
    known = located(str(checkpoint))
    assert located(str(copy)).identity == known.identity
    write_note(copy, Note(FAMILY, VERSION))
    assert located(str(copy)).identity == known.identity
    config = copy / "generation_config.json"
    config.write_text(config.read_text() + "\n")
    assert located(str(copy)).identity != known.identity


def test_a_name_on_the_hub_is_known_by_its_commit(checkpoint, tmp_path, monkeypatch):
    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_CACHE", str(tmp_path))
    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_OFFLINE", True)
    commit = "0123456789abcdef0123456789abcdef01234567"
    repository = tmp_path / "models--somebody--tiny"
    shutil.copytree(checkpoint, repository / "snapshots" / commit)
    (repository / "refs").mkdir()
    (repository / "refs" / "main").write_text(commit)
    place = located("somebody/tiny")
    assert place.identity == {"revision": commit}
    assert place.folder == repository / "snapshots" / commit
    with pytest.raises(CheckpointError, match="download it elsewhere and name its"):
        located("somebody/else")


@pytest.mark.parametrize("name", ["/nowhere/at/all", "./nowhere", "nothing", "a/b/c"])
def test_what_is_no_place_is_told(name):
    with pytest.raises(CheckpointError, match="is no folder, and no name on the Hub"):
        located(name)


def test_a_folder_without_weights_is_no_checkpoint(tmp_path):
    with pytest.raises(CheckpointError, match=r"has no \*\.safetensors"):
        located(str(tmp_path))


def test_a_folder_has_no_revision(checkpoint):
    with pytest.raises(CheckpointError, match="revision = 'v2' cannot be"):
        located(str(checkpoint), "v2")


def test_what_was_trained_for_scenes_is_not_asked_for_programs(tmp_path):
    write_note(tmp_path, Note(FAMILY, VERSION, {"task": "scene"}))
    check_trained(tmp_path, "scene")
    with pytest.raises(CheckpointError, match="set task = scene"):
        check_trained(tmp_path, "program")
