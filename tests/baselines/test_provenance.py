"""What results have in common: which packages could matter, and nothing by chance."""

import hashlib
import json
import sys
from importlib import import_module, invalidate_caches
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
def provenance_of(tmp_path):
    (tmp_path / RECORD).write_text(made_record("tiny").text())
    return lambda predictor: Provenance.of(tmp_path, predictor, "tiny", "test")


@pytest.fixture
def versions_of(provenance_of, monkeypatch):
    monkeypatch.setitem(sys.modules, "openai", ModuleType("openai"))  # by some other
    return lambda predictor: provenance_of(predictor).versions.keys()


def test_what_this_process_has_loaded_is_no_property_of_a_built_in_predictor(
    versions_of,
):
    assert versions_of(CopyLast()) == set(PACKAGES)


def test_what_a_predictor_says_it_uses_is_told(versions_of):
    assert versions_of(Telling()) == {*PACKAGES, "pyyaml"}


def test_of_another_predictor_what_is_loaded_is_told(versions_of):
    pytest.importorskip("openai")
    assert "openai" in versions_of(Mine())


@pytest.fixture
def digest_of_code(tmp_path, monkeypatch, provenance_of):
    """Digest of a predictor of a module with some text."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def digest_of(code):
        (tmp_path / "somebody_s.py").write_text(code)
        invalidate_caches()
        sys.modules.pop("somebody_s", None)
        made = import_module("somebody_s").Theirs()
        return provenance_of(made).predictor_sha256

    yield digest_of
    sys.modules.pop("somebody_s", None)


def test_another_predictor_whose_source_has_changed_is_another(digest_of_code):
    code = 'class Theirs:\n    name = "theirs"\n    shade = {}\n'
    assert digest_of_code(code.format(3)) != digest_of_code(code.format(4))
    assert digest_of_code(code.format(3)) == digest_of_code(code.format(3))


def digest_of_name_and_no_options(name):
    return hashlib.sha256(json.dumps([name, {}]).encode()).hexdigest()


@pytest.mark.parametrize(
    ("made_by", "name"),
    [
        (CopyLast, "mpmworlds.baselines.simple.copy_last:CopyLast"),
        (type("Typed", (Mine,), {"__module__": "no.file"}), "no.file:Typed"),
    ],
    ids=["built in", "typed into an interpreter"],
)
def test_without_a_source_file_of_others_only_name_and_options_count(
    provenance_of, made_by, name
):
    expected = digest_of_name_and_no_options(name)
    assert provenance_of(made_by()).predictor_sha256 == expected
