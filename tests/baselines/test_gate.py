"""The prefix-quality gate: fitted on one split, applied to another."""

import json
import math

import pytest

from mpmworlds.baselines.gate import fit, gate_report, gate_table, gated, read_gate
from mpmworlds.baselines.system import ComparisonError, System
from mpmworlds.metrics import SCORED
from tests.baselines.made_results import result, write

MODIFIED = {"split": "modification_validation"}
# Of program and fallback: goodness of the prefix, of the continuation, of the fallback.
# By hand: errors .1 .2 .7 .9 of the programs and .5 of the fallback, so it is best to
# keep the first two, whose prefix errors are .05 and .15, and not that of .35.
FIT = {
    "p0001": (0.95, 0.9, 0.5),
    "p0002": (0.85, 0.8, 0.5),
    "p0003": (0.65, 0.3, 0.5),
    "p0004": (0.45, 0.1, 0.5),
}
TEST = {
    "p0011": (0.8, 0.7, 0.5),
    "p0012": (0.7, 0.9, 0.5),
    "p0013": (0.9, 0.2, 0.5),
    "p0014": (None, None, 0.5),
}


@pytest.fixture
def make_pair(tmp_path):
    """Function (table, changes) -> the folders of program and fallback."""

    def make(table, **changes):
        split = changes.get("split", "test")
        program = [
            [result(sample, goodness, prefix=prefix)]
            for sample, (prefix, goodness, _) in table.items()
        ]
        fallback = [[result(sample, other)] for sample, (_, _, other) in table.items()]
        return (
            write(tmp_path / split / "search", program, predictor="search", **changes),
            write(tmp_path / split / "copy_last", fallback, **changes),
        )

    return make


def systems(folders):
    return tuple(map(System.read, folders))


@pytest.mark.parametrize("metric", SCORED)
def test_threshold_is_the_midpoint_that_makes_the_error_least(make_pair, metric):
    pair = systems(make_pair(FIT, **MODIFIED))
    tau = fit(*pair, metric)
    midpoint = (0.15 + 0.35) / 2
    assert tau == pytest.approx(1 - midpoint if metric == "mask_iou" else midpoint)
    rows, kept = gated(*pair, metric, tau)
    assert kept == 0.5
    errors = [abs(row.value(metric) - SCORED[metric].best) for row in rows]
    assert errors == pytest.approx([0.1, 0.2, 0.5, 0.5])


@pytest.mark.parametrize("metric", SCORED)
def test_gate_that_keeps_all_is_the_program_and_one_that_keeps_none_the_fallback(
    make_pair, metric
):
    program, fallback = systems(make_pair(FIT, **MODIFIED))
    all_in = -math.inf if SCORED[metric].direction == "up" else math.inf
    for tau, system, share in ((all_in, program, 1.0), (-all_in, fallback, 0.0)):
        rows, kept = gated(program, fallback, metric, tau)
        assert kept == share
        assert [row.scores for row in rows] == [
            row.scores for row in system.rows(metric)
        ]


def test_report_shows_both_systems_the_gate_and_the_better_of_both(make_pair):
    report = read_gate(make_pair(FIT, **MODIFIED), make_pair(TEST))
    entry = report["metrics"]["semd"]
    assert entry["tau"] == pytest.approx(0.25)

    def means(part):
        return {
            name: found["failures_at_worst"]["mean"]
            for name, found in entry[part].items()
            if name != "kept"
        }

    assert means("fit") == pytest.approx(
        {
            "program": (0.1 + 0.2 + 0.7 + 0.9) / 4,
            "fallback": 0.5,
            "gate": (0.1 + 0.2 + 0.5 + 0.5) / 4,
            "oracle_gate": (0.1 + 0.2 + 0.5 + 0.5) / 4,
        }
    )
    # Prefix errors .2 and .1 are below tau, .3 is not; what failed is never kept.
    assert entry["applied"]["kept"] == 0.5
    assert means("applied") == pytest.approx(
        {
            "program": (0.3 + 0.1 + 0.8 + 1.0) / 4,
            "fallback": 0.5,
            "gate": (0.3 + 0.5 + 0.8 + 0.5) / 4,
            "oracle_gate": (0.3 + 0.1 + 0.5 + 0.5) / 4,
        }
    )
    assert json.loads(json.dumps(report, allow_nan=False)) == report


def test_of_equally_good_thresholds_the_one_that_keeps_most_is_taken(make_pair):
    table = {f"p000{k}": (0.5 + k / 10, 0.5, 0.5) for k in range(4)}
    pair = systems(make_pair(table, **MODIFIED))
    assert fit(*pair, "mse") == math.inf
    assert fit(*pair, "mask_iou") == -math.inf
    report = gate_report(pair)
    assert report["metrics"]["mse"]["tau"] == "inf"
    assert report["metrics"]["mse"]["fit"]["kept"] == 1.0


def test_equal_prefix_scores_are_kept_or_dropped_together(make_pair):
    table = {"p0001": (0.5, 1.0, 0.5), "p0002": (0.5, 0.25, 0.5)}
    pair = systems(make_pair(table, **MODIFIED))
    assert fit(*pair, "mse") == math.inf  # .75 together, 1 without


def test_program_that_failed_is_never_kept(make_pair):
    table = FIT | {"p0005": (None, None, 0.5)}
    pair = systems(make_pair(table, **MODIFIED))
    rows, kept = gated(*pair, "mse", math.inf)
    assert kept == 0.8
    assert rows[-1].outcome == "ok"


def test_gate_goes_by_the_candidate_that_each_metric_chooses(tmp_path):
    first = result("p0001", 0.25, prefix=0.9, candidates=2)
    second = result("p0001", 0.75, prefix=0.5, candidates=2, candidate=1)
    first.prefix["mse"] = 1.0  # so that mse alone chooses the second one
    program = write(tmp_path / "a", [[first, second]], predictor="search", **MODIFIED)
    fallback = write(tmp_path / "b", [[result("p0001", 0.5)]], **MODIFIED)
    pair = systems((program, fallback))
    for metric, tau, error in (("semd", -math.inf, 0.5), ("mse", math.inf, 0.25)):
        assert fit(*pair, metric) == tau
        (row,), _ = gated(*pair, metric, tau)
        assert row.value(metric) == error


def test_gate_is_not_fitted_on_test(make_pair):
    with pytest.raises(ComparisonError, match=r"search: of split 'test', a gate is"):
        read_gate(make_pair(FIT))


def test_gate_is_not_applied_to_what_it_is_fitted_on(make_pair):
    pair = make_pair(FIT, **MODIFIED)
    with pytest.raises(ComparisonError, match="to one other split than it is fitted"):
        read_gate(pair, pair)


def test_missing_prefix_score_is_named(make_pair):
    program, fallback = make_pair(FIT, **MODIFIED)
    with pytest.raises(ComparisonError, match="p0001, candidate 0: no mask_iou of its"):
        read_gate((fallback, program))


def test_different_samples_are_named(make_pair, tmp_path):
    program, _ = make_pair(FIT, **MODIFIED)
    less = write(tmp_path / "less", [[result("p0002", 0.5)]], **MODIFIED)
    with pytest.raises(ComparisonError, match="has p0001, p0003, p0004; evaluate both"):
        read_gate((program, less))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"regime": "no_materials"}, "a gate is of one regime"),
        ({"release_sha256": "other"}, "of release other, must be that of"),
        ({"metrics_version": "mpmworlds-metrics/1"}, "scored by mpmworlds-metrics/1"),
        ({"constants_sha256": "other"}, "scored with constants other"),
    ],
)
def test_results_that_do_not_belong_together_are_refused(make_pair, changes, message):
    with pytest.raises(ComparisonError, match=message):
        read_gate(make_pair(FIT, **MODIFIED), make_pair(TEST, **changes))


def test_gate_is_applied_to_the_systems_it_is_fitted_to(make_pair):
    fitted, (_, fallback) = make_pair(FIT, **MODIFIED), make_pair(TEST)
    with pytest.raises(
        ComparisonError, match="predictor, other options or source than"
    ):
        read_gate(fitted, (fallback, fallback))


def test_table_has_a_line_for_each_metric_and_split(make_pair):
    report = read_gate(make_pair(FIT, **MODIFIED), make_pair(TEST))
    lines = [line.split() for line in gate_table(report).splitlines()]
    (fitted, applied) = (line for line in lines if line[:1] == ["mask_iou"])
    kept = ["mask_iou", "up", "0.7500", "50.0%"]
    assert fitted == [*kept, "0.5250", "0.5000", "0.6750", "0.6750"]
    assert applied == [*kept, "0.4500", "0.5000", "0.4750", "0.6500"]


def test_verb_prints_the_table_and_writes_the_report(command, make_pair, tmp_path):
    fitted, applied = make_pair(FIT, **MODIFIED), make_pair(TEST)
    arguments = ["--fit", *fitted, "--apply", *applied, "--out", tmp_path / "gate"]
    status, out, _ = command("gate", *arguments)
    report = read_gate(fitted, applied)
    assert (status, out) == (0, gate_table(report))
    assert json.loads((tmp_path / "gate/gate.json").read_text()) == report
