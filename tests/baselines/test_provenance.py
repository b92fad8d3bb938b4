"""What results have in common: which packages could matter, and nothing by chance."""

import sys
from types import ModuleType

import pytest

from mpmworlds.baselines.provenance import PACKAGES, Provenance
from mpmworlds.baselines.simple.copy_last import CopyLast
from mpmworlds.builder.release.layout import RECORD
from tests.baselines.made_results import made_record


class Mine:
    """A predictor of somebody else, who says nothing of packages."""

    name = "mine"


class Telling(CopyLast):
    """One that says what it uses."""

    packages = ("pyyaml",)


@pytest.fixture
def versions_of(tmp_path, monkeypatch):
    (tmp_path / RECORD).write_text(made_record("tiny").text())
    monkeypatch.setitem(sys.modules, "openai", ModuleType("openai"))  # by some other
    return lambda predictor: Provenance.of(
        tmp_path, predictor, "tiny", "test"
    ).versions.keys()


def test_what_this_process_has_loaded_is_no_property_of_a_built_in_predictor(
    versions_of,
):
    assert versions_of(CopyLast()) == set(PACKAGES)


def test_what_a_predictor_says_it_uses_is_told(versions_of):
    assert versions_of(Telling()) == {*PACKAGES, "pyyaml"}


def test_of_another_predictor_what_is_loaded_is_told(versions_of):
    pytest.importorskip("openai")
    assert "openai" in versions_of(Mine())
