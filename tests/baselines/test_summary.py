"""Summaries and their table."""

import json
from dataclasses import asdict, replace

import jsonschema
import pytest

from mpmworlds.baselines.results import Result
from mpmworlds.baselines.schemas import SCHEMAS
from mpmworlds.baselines.slices import parts
from mpmworlds.baselines.summary import summarise_results, summary_table
from mpmworlds.metrics import SCORED


def result(number, value, materials=("liquid",), num_objects=1, types=("emitter",)):
    scores = None if value is None else dict.fromkeys(SCORED, value)
    return Result(
        sample_id=f"p{number:04d}",
        family_id=f"p{number:04d}",
        materials=list(materials),
        object_types=list(types),
        num_objects=num_objects,
        motion=None,
        ceiling=None,
        candidate=0,
        candidates=1,
        outcome="crash" if value is None else "ok",
        reason="",
        continuation=scores,
        prefix=None,
        curves=None,
        processor="",
    )


RESULTS = [
    result(1, 0.25, ["liquid"], 1),
    result(2, 0.75, ["elastic", "sand"], 10, ["dynamic_body"]),
    result(3, None, ["elastic", "snow"], 2, ["dynamic_body", "emitter"]),
]


def test_table_shows_both_summaries_of_every_metric(provenance):
    table = summary_table(summarise_results(provenance, RESULTS)).splitlines()
    assert table[0] == "copy_last on tiny/test, frames_only, mpmworlds-metrics/2"
    assert table[1] == "3 samples, 3 candidates: 1 crash, 2 ok"
    assert table[3].split()[:3] == ["continuation", "valid", "only"]
    rows = {line.split()[0]: line for line in table[4:]}
    assert list(rows) == list(SCORED)
    # Of three families there is no interval.
    assert rows["semd"].split() == [
        *("semd", "down", "0.5000", "+-", "0.2500", "-", "2"),
        *("0.6667", "+-", "0.2205", "-", "3"),
    ]


def test_undefined_numbers_are_dashes(provenance):
    table = summary_table(summarise_results(provenance, [result(1, None)]))
    assert table.splitlines()[-1].split() == [
        *("anomaly_excess", "down", "-", "-", "0", "1.0000", "-", "1")
    ]


@pytest.mark.parametrize(
    ("expected", "troubles", "told"),
    [
        (5, {}, "INCOMPLETE: 2 samples are missing"),
        (4, {"p0004": "no network"}, "INCOMPLETE: 1 sample is missing (p0004: no net"),
    ],
)
def test_table_says_what_is_missing_and_why_if_it_is_known(
    provenance, expected, troubles, told
):
    table = summary_table(summarise_results(provenance, RESULTS, expected, troubles))
    assert table.splitlines()[2].startswith(told)
    assert "()" not in table


def test_summary_survives_json(provenance):
    summary = summarise_results(provenance, RESULTS)
    text = json.dumps(summary, allow_nan=False)
    again = json.loads(text)
    assert json.dumps(again) == text
    assert summary_table(again) == summary_table(summary)


def test_order_of_the_results_is_irrelevant(provenance):
    summary = summarise_results(provenance, RESULTS)
    assert json.dumps(summarise_results(provenance, RESULTS[::-1])) == json.dumps(
        summary
    )


def test_prefix_is_summarised_only_where_every_valid_candidate_has_one(provenance):
    assert "prefix" not in summarise_results(provenance, RESULTS)


def ids_of(members_of):
    return {
        part: [result.sample_id for result in members]
        for part, members in members_of.items()
    }


def test_sample_is_in_the_slice_of_each_of_its_materials():
    assert ids_of(parts(RESULTS)["material_family"]) == {
        "elastic/plastic": ["p0002", "p0003"],
        "liquid": ["p0001"],
        "sand": ["p0002"],
        "snow": ["p0003"],
    }


def test_sample_is_in_the_slice_of_each_type_of_its_objects(provenance):
    assert ids_of(parts(RESULTS)["object_type"]) == {
        "dynamic_body": ["p0002", "p0003"],
        "emitter": ["p0001", "p0003"],
    }
    told = summarise_results(provenance, RESULTS)["slices"]["object_type"]
    assert told["emitter"]["mse"]["failures_at_worst"]["mean"] == 0.625


def test_a_type_that_several_objects_have_counts_once():
    several = result(1, 0.5, types=["emitter", "emitter"])
    assert ids_of(parts([several])["object_type"]) == {"emitter": ["p0001"]}


def test_numbered_parts_are_ordered_by_size():
    table = parts(RESULTS)
    assert list(table["num_objects"]) == ["1", "2", "10"]
    assert list(table["num_materials"]) == ["1", "2"]


def test_slices_add_up_to_the_whole(provenance):
    summary = summarise_results(provenance, RESULTS)
    for name in ("num_objects", "num_materials"):
        counts = [
            part["mse"]["failures_at_worst"]["n"]
            for part in summary["slices"][name].values()
        ]
        assert sum(counts) == summary["samples"]


def test_unknown_material_is_an_error():
    with pytest.raises(ValueError, match="p0001: material 'jelly', must be one of"):
        parts([result(1, 0.5, ["jelly"])])


@pytest.mark.parametrize("results", [RESULTS, []], ids=["some", "none"])
def test_files_are_what_their_schemas_say(provenance, results):
    summary = json.loads(json.dumps(summarise_results(provenance, results, 5)))
    jsonschema.validate(summary, SCHEMAS["summary"]())
    assert summary["expected"] == 5
    for row in results:
        line = json.loads(json.dumps(asdict(row) | asdict(provenance)))
        jsonschema.validate(line, SCHEMAS["results"]())
        with pytest.raises(jsonschema.ValidationError, match="motto"):
            jsonschema.validate(line | {"motto": ""}, SCHEMAS["results"]())


def test_choices_are_told_where_all_candidates_were_run(provenance):
    several = [
        replace(
            result(1, value),
            candidate=k,
            candidates=3,
            prefix=dict.fromkeys(SCORED, 0.0) | {"mask_iou": 1 - value},
        )
        for k, value in enumerate([0.25, 0.75, 0.5])
    ]
    summary = summarise_results(provenance, several)
    choices = {
        name: table["mask_iou"]["valid"]["mean"]
        for name, table in summary["choices"].items()
    }
    assert choices == {"random": 0.5, "oracle": 0.75}
    assert summary["continuation"]["mask_iou"]["valid"]["mean"] == 0.25
    stopped = replace(several[2], outcome="passed_over", continuation=None)
    assert "choices" not in summarise_results(provenance, [*several[:2], stopped])


def test_parts_of_the_continuation_are_means_of_curves(provenance):
    curves = {name: [0.0, 0.0, 0.5, 0.5, 1.0, 1.0] for name in SCORED}
    summary = summarise_results(provenance, [replace(result(1, 0.5), curves=curves)])
    parts_of = summary["slices"]["horizon"]
    means = [part["mse"]["valid"]["mean"] for part in parts_of.values()]
    assert (list(parts_of), means) == (["1/3", "2/3", "3/3"], [0.0, 0.5, 1.0])
