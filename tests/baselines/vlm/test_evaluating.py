"""From data to tables: finetune, write, run in the sandbox, score, report."""

import pytest

from mpmworlds.baselines.results import read_results
from mpmworlds.sim.run.receive import STATUSES

OUTCOMES = STATUSES | {"truncated", "no_program"}
TINY = ("--recipe", "tiny", "--set", "batch=1", "--set", "save_steps=99")


def test_whatever_a_random_model_writes_ends_in_a_typed_outcome(
    command, release, checkpoint, tmp_path
):
    options = ["candidates=3", "max_new_tokens=30", "pictures=2"]
    status, printed, err = command(
        *("evaluate", "--predictor", "vlm", "--release", release),
        *("--predictor-option", f"checkpoint={checkpoint}", "--out", tmp_path / "out"),
        *(part for one in options for part in ("--predictor-option", one)),
    )
    assert status == 0, err
    provenance, results = read_results(tmp_path / "out" / "results.jsonl")
    assert len(results) == 2 * 3
    assert {result.outcome for result in results} <= OUTCOMES
    assert "truncated" in {result.outcome for result in results}
    assert provenance.options["checkpoint"] == ""
    assert len(provenance.options["weights_sha256"]) == 64
    assert {"torch", "transformers"} <= provenance.versions.keys()
    assert "vlm" in printed


@pytest.mark.slow
def test_a_sample_that_was_learned_is_written_run_and_reported(
    command, release, checkpoint, tmp_path
):
    """Enough steps on one sample that the model knows its program by heart."""
    model, results = tmp_path / "model", tmp_path / "results"
    where = ("--release", release, "--config", "mini", "--split", "test")
    status, printed, err = command(
        *("train", "vlm", *where, *TINY, "--set", "epochs=90"),
        *("--set", "learning_rate=0.01", "--set", f"checkpoint={checkpoint}"),
        *("--out", model),
    )
    assert (status, printed) == (0, f"{model}\n"), err
    options = [f"checkpoint={model}", "candidates=2", "temperature=0.3", "pictures=2"]
    options += ["max_new_tokens=300"]
    status, _, err = command(
        *("evaluate", "--predictor", "vlm", *where, "--out", results, "--keep-clips"),
        *(part for one in options for part in ("--predictor-option", one)),
    )
    assert status == 0, err
    _, found = read_results(results / "results.jsonl")
    scored = [one for one in found if one.outcome == "ok"]
    assert scored, [(one.outcome, one.reason) for one in found]
    assert max(one.continuation["mask_iou"] for one in scored) == 1.0
    status, _, err = command("report", results, "--out", tmp_path / "report")
    assert status == 0, err
    assert "vlm" in (tmp_path / "report" / "data.js").read_text()
