"""The verbs that look at a manifest."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from mpmworlds.builder.plan.manifest import SCHEMA, text_sha256, write_manifest
from mpmworlds.cli import main
from mpmworlds.splits.near_duplicates import NEAR
from tests.made_up import SPLIT, rows

ROOT = Path(__file__).resolve().parents[1]
SPLIT_DATA = {
    "salt": SPLIT.salt,
    "test_fraction": SPLIT.test_fraction,
    "modification_fraction": SPLIT.modification_fraction,
}


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    path = tmp_path_factory.mktemp("inspect") / "manifest.parquet"
    write_manifest(path, rows())
    return path


@pytest.fixture
def params(tmp_path):
    """Return a parameter file whose profile `made_up` has the splits of the corpus."""
    data = yaml.safe_load((ROOT / "params.yaml").read_text())
    data["profiles"] = {"made_up": data["profiles"]["tiny"] | {"split": SPLIT_DATA}}
    path = tmp_path / "params.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


@pytest.fixture
def sound(params, manifest):
    """Return the options that name the corpus and its parameters."""
    return ["--config", "made_up", "--params", params, "--manifest", manifest]


def test_stats_print_the_corpus_beside_the_paper(command, manifest):
    status, out, err = command("stats", "--manifest", manifest)
    assert (status, err) == (0, "")
    assert re.search(r"^scenes +36 +95,805$", out, re.MULTILINE)
    assert "publishes no numbers for them" in " ".join(out.split())


def test_stats_by_split_have_a_column_for_each(command, manifest):
    _, out, _ = command("stats", "--manifest", manifest, "--by-split")
    assert re.search(r"^scenes +36 +18 +6 +12 +95,805$", out, re.MULTILINE)


def test_stats_check_fails_when_a_target_does_not_hold(command, manifest):
    status, out, _ = command("stats", "--manifest", manifest, "--check")
    assert status == 1
    assert "DOES NOT HOLD" in out


def test_stats_for_programs_are_json(command, manifest):
    status, out, _ = command("stats", "--manifest", manifest, "--json", "--by-split")
    data = json.loads(out)
    assert status == 0
    assert list(data["statistics"]) == [
        "all",
        "train",
        "modification_validation",
        "test",
    ]
    assert {target["holds"] for target in data["targets"]} <= {True, False}


def test_stats_draw_a_figure(command, manifest, tmp_path):
    pytest.importorskip("matplotlib")
    figure = tmp_path / "stats.svg"
    status, _, err = command("stats", "--manifest", manifest, "--figure", figure)
    assert (status, err) == (0, f"{figure}: written\n")
    assert figure.read_bytes().startswith(b"<?xml")


@pytest.mark.parametrize("verb", ["stats", "audit"])
def test_profile_without_a_recorded_manifest_says_how_to_make_one(verb, command):
    status, out, err = command(verb, "--config", "made_up")
    assert (status, out) == (2, "")
    assert "there is no recorded manifest of 'made_up', only of ['full', 'tiny']" in err
    assert "mpmworlds plan --config made_up --out FILE" in err


def test_audit_of_other_parameters_needs_their_manifest(command, params):
    status, out, err = command("audit", "--config", "made_up", "--params", params)
    assert (status, out) == (2, "")
    assert "--params: the recorded manifest is of other parameters" in err


@pytest.mark.parametrize("verb", ["stats", "audit"])
def test_subset_of_a_manifest_is_refused(verb, command, manifest):
    status, out, err = command(verb, "--config", "10k", "--manifest", manifest)
    assert (status, out) == (2, "")
    assert "--config 10k: is a subset of 'full'" in err


def test_audit_of_a_manifest_must_know_its_splits(command, manifest):
    status, out, err = command("audit", "--manifest", manifest)
    assert (status, out) == (2, "")
    assert "--config: is missing; name the profile whose splits" in err


@pytest.mark.parametrize("verb", ["stats", "audit"])
def test_help_shows_an_example(verb, capsys):
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    assert f"example: mpmworlds {verb} " in " ".join(capsys.readouterr().out.split())


def test_help_tells_the_distance_that_is_near(capsys):
    with pytest.raises(SystemExit):
        main(["audit", "--help"])
    assert f"(default {NEAR})" in " ".join(capsys.readouterr().out.split())


def test_audit_of_a_sound_corpus_finds_no_leak(command, sound, manifest):
    status, out, _ = command("audit", *sound)
    first, second = out.splitlines()
    assert status == 0
    assert first == (
        f"{manifest}: 36 samples, 18 templates compared by distance: no leak"
    )
    assert "own family are near, as they are meant to be" in second


@pytest.fixture
def leaky(sound, tmp_path):
    """Return options that name a corpus with a train scene in test."""
    origin = next(row for row in rows() if row.id == "p0002-n00")
    leak = {"scene": origin.scene, "scene_sha256": text_sha256(origin.scene)}
    path = tmp_path / "leaky.parquet"
    write_manifest(
        path, [replace(row, **leak) if row.id == "p0001-n00" else row for row in rows()]
    )
    return [*sound[:-1], path]


def test_audit_names_a_leak(command, leaky):
    status, out, _ = command("audit", *leaky)
    assert status == 1
    assert out.splitlines()[0] == (
        "p0001-n00, p0002-n00: same scene: 1 in test, 1 in train"
    )
    assert "36 samples, 18 templates compared by distance: 1 problems" in out


def test_audit_for_programs_is_json(command, leaky):
    status, out, _ = command("audit", *leaky, "--json")
    data = json.loads(out)
    assert status == 1
    assert (data["samples"], data["templates"]) == (36, 18)
    assert [problem["rule"] for problem in data["problems"]] == ["same scene"]
    assert data["problems"][0]["ids"] == ["p0001-n00", "p0002-n00"]
    assert data["kin"]


def test_audit_finds_a_row_that_occurs_twice(command, sound, tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(sound[-1])
    path = tmp_path / "twice.parquet"
    pq.write_table(pa.concat_tables([table, table.slice(0, 1)]).cast(SCHEMA), path)
    status, out, _ = command("audit", *sound[:-1], path)
    assert status == 1
    assert out.splitlines()[0] == "p0000: repeated id: 2 rows have it, must be one"


def test_negative_distance_is_wrong_use(command, sound):
    status, out, err = command("audit", *sound, "--near", "-1")
    assert (status, out) == (2, "")
    assert "near = -1.0, must be >= 0" in err
