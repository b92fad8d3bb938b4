"""What learned baselines share: extras, devices, notes, settings."""

import pytest

from mpmworlds.baselines.learned import devices, extras
from mpmworlds.baselines.learned.devices import (
    TooLittleMemoryError,
    check_fits,
    device_named,
    memory_of,
)
from mpmworlds.baselines.learned.extras import MissingExtraError, need
from mpmworlds.baselines.learned.families import FAMILIES
from mpmworlds.baselines.learned.notes import Note, read_note, write_note
from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.baselines.registry import predictor_named


def test_a_missing_package_names_the_command(monkeypatch):
    need("small", "json")
    monkeypatch.setattr(
        extras, "find_spec", lambda name: None if name == "torch" else name
    )
    with pytest.raises(
        MissingExtraError, match=r"torch: .*pip install 'mpmworlds\[small\]'"
    ):
        predictor_named("small")


def test_what_does_not_fit_says_what_would():
    torch = pytest.importorskip("torch")
    here = torch.device("cpu")
    check_fits("a toy", 1e6, here, "")
    with pytest.raises(TooLittleMemoryError, match=r"needs about .* GiB, cpu has"):
        check_fits("a giant", 2 * memory_of(here), here, "take a smaller one")


def test_a_device_that_is_not_there_is_told():
    torch = pytest.importorskip("torch")
    assert device_named("cpu") == torch.device("cpu")
    with pytest.raises(RuntimeError, match="device 'sofa'"):
        device_named("sofa")
    if not torch.cuda.is_available():
        assert device_named() == torch.device("cpu")
        with pytest.raises(RuntimeError, match="sees no GPU; take 'cpu'"):
            device_named("cuda")
    assert devices.GIB == 2**30


def test_a_note_comes_back(tmp_path):
    note = Note("small", 3, {"batch": 2}, {"regime": "caption"}, 7)
    write_note(tmp_path, note)
    assert read_note(tmp_path, "small", 3) == note


class Some(Settings):
    """Two settings."""

    many: int = 1
    rate: float = 0.5


def test_settings_of_a_file_are_changed_by_name(tmp_path, monkeypatch):
    monkeypatch.setattr(Some, "recipes", classmethod(lambda cls: []))
    path = tmp_path / "mine.yaml"
    path.write_text("many: 3\n")
    assert Some.read(str(path), {"rate": 2}) == Some(many=3, rate=2.0)
    for text, told in (("many: x", "many = 'x'"), ("- 1", "mapping"), ("{", "YAML")):
        path.write_text(text)
        with pytest.raises(ValueError, match=told):
            Some.read(str(path))
    with pytest.raises(ValueError, match=r"fewer = 1.*settings are many, rate"):
        Some.read("", {"fewer": 1})


def test_families_are_folders():
    from pathlib import Path

    import mpmworlds.baselines as baselines

    home = Path(baselines.__path__[0])
    assert all((home / family / "training.py").is_file() for family in FAMILIES)
