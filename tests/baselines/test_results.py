"""The results file survives torn ends and refuses what does not belong in it."""

import dataclasses
import itertools
import json
import logging

import pytest

from mpmworlds.baselines.provenance import Provenance
from mpmworlds.baselines.results import (
    Result,
    ResultsError,
    ResultsFile,
    read_results,
)
from mpmworlds.baselines.simple.copy_last import CopyLast
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.metrics import SCORED


def result(sample_id, candidate=0, candidates=1, **changes):
    fields = {
        "sample_id": sample_id,
        "family_id": sample_id[:5],
        "materials": ["liquid"],
        "object_types": ["dynamic_body"],
        "num_objects": 2,
        "motion": 0.25,
        "ceiling": dict.fromkeys(SCORED, 0.5),
        "candidate": candidate,
        "candidates": candidates,
        "outcome": "ok",
        "reason": "",
        "continuation": dict.fromkeys(SCORED, 0.25),
        "prefix": None,
        "curves": {name: [0.25, 0.5] for name in SCORED},
        "processor": "one of ours",
    }
    return Result(**fields | changes)


SAMPLES = [
    [result("p0001")],
    [result("p0002", candidate, 3) for candidate in range(3)],
    [result("p0003", outcome="timeout", reason="60 s", continuation=None)],
]


@pytest.fixture
def path(tmp_path, provenance):
    path = tmp_path / "results.jsonl"
    with ResultsFile(path, provenance) as file:
        for results in SAMPLES:
            file.append(results)
    return path


def test_reading_inverts_writing(path, provenance):
    assert read_results(path) == (provenance, [*itertools.chain(*SAMPLES)])


def test_reopened_file_knows_its_samples(path, provenance):
    with ResultsFile(path, provenance) as file:
        assert [file.get(results[0].sample_id) for results in SAMPLES] == SAMPLES
        assert file.get("p0004") is None


def test_any_torn_end_is_cut_off_to_whole_samples(path, provenance, caplog):
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    ends = [0, len(lines[0]), len(b"".join(lines[:4])), len(whole)]
    for size in range(0, len(whole) + 1, 31):
        path.write_bytes(whole[:size])
        caplog.clear()
        with ResultsFile(path, provenance) as file:
            kept = max(end for end in ends if end <= size)
            assert path.stat().st_size == kept
            assert ("not written whole" in caplog.text) == (size not in ends)
            for results in SAMPLES[ends.index(kept) :]:
                assert file.get(results[0].sample_id) is None
                file.append(results)
        assert path.read_bytes() == whole


def test_message_about_a_torn_end_is_a_warning(path, provenance, caplog):
    path.write_bytes(path.read_bytes() + b"\0\0\0")
    with ResultsFile(path, provenance):
        pass
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert "3 bytes are dropped" in record.getMessage()


@pytest.mark.parametrize("field", [f.name for f in dataclasses.fields(Provenance)])
def test_results_of_another_provenance_do_not_mix(path, provenance, field):
    before = path.read_bytes()
    other = dataclasses.replace(provenance, **{field: "other"})
    with pytest.raises(ResultsError, match=f"line 1 has {field} = .*must be 'other'"):
        ResultsFile(path, other)
    assert path.read_bytes() == before


def test_mixed_file_is_refused_when_read(path, provenance):
    row = json.loads(path.read_bytes().splitlines()[0]) | {"predictor": "other"}
    with path.open("a") as stream:
        stream.write(json.dumps(row) + "\n")
    with pytest.raises(ResultsError, match="line 6 has predictor = 'other'"):
        read_results(path)


def test_damage_before_the_end_is_an_error(path, provenance):
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b"{damage}\n" + lines[4])
    with pytest.raises(ResultsError, match="line 2 is no JSON"):
        ResultsFile(path, provenance)


@pytest.mark.parametrize("order", [[0, 0], [0, 1, 3], [1, 2, 4], [2]])
def test_samples_that_repeat_or_are_out_of_order_are_an_error(path, provenance, order):
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[number] for number in order))
    with pytest.raises(ResultsError, match="out of order"):
        ResultsFile(path, provenance)


def test_line_without_a_field_is_an_error(path, provenance):
    path.write_text('{"sample_id": "p0001"}\n')
    with pytest.raises(ResultsError, match=r"line 1 has no .*'candidate'"):
        ResultsFile(path, provenance)


def test_empty_file_is_no_result(tmp_path):
    (tmp_path / "results.jsonl").touch()
    with pytest.raises(ResultsError, match="empty"):
        read_results(tmp_path / "results.jsonl")


def test_file_is_written_by_one_process_at_a_time(path, provenance):
    with (
        ResultsFile(path, provenance),
        pytest.raises(ResultsError, match="another process"),
    ):
        ResultsFile(path, provenance)
    with ResultsFile(path, provenance) as file:
        assert file.get("p0001")


def test_provenance_follows_the_content_of_the_configuration(corpus, tmp_path):
    def build(configs):
        planned = Corpus(corpus.manifest, configs)
        build_release([planned], corpus.store, tmp_path / "release", version="1.0.0")
        return Provenance.of(tmp_path / "release", CopyLast(), "tiny", "test")

    before = build({"tiny": None})
    assert build({"mini": ["p0000"]}) == before
    assert build({"tiny": ["p0002"]}).release_sha256 != before.release_sha256


def test_release_without_checksums_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"release\.json: is not there"):
        Provenance.of(tmp_path, CopyLast(), "tiny", "test")
