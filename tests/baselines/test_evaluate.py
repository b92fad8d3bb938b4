"""The loop: every sample ends in a typed outcome, and any stop can be gone on from."""

import json
import pickle
import re
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from mpmworlds.baselines import evaluate as evaluate_module
from mpmworlds.baselines import execution
from mpmworlds.baselines.evaluate import evaluate_examples
from mpmworlds.baselines.protocol import (
    Candidate,
    Failure,
    InfrastructureError,
    ProgramText,
    SceneText,
)
from mpmworlds.baselines.results import ResultsError, read_results
from mpmworlds.baselines.scoring import How, score_example, task_of
from mpmworlds.baselines.simple.black import Black
from mpmworlds.baselines.simple.copy_last import CopyLast
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.metrics import SCORED
from mpmworlds.sim.run.encode import decode_mp4
from mpmworlds.sim.run.run import SandboxError


class Answers:
    """Gives prepared answers; an exception among them is raised."""

    name = "copy_last"

    def __init__(self, *answers):
        self.answers = answers
        self.tasks = []

    def predict(self, task):
        self.tasks.append(task)
        for answer in self.answers:
            if isinstance(answer, Exception):
                raise answer
        return self.answers


@pytest.fixture
def examples(make_example):
    return [make_example(f"p{number:04d}") for number in range(5)]


def results_of(example, predictor):
    return score_example(example, predictor).results


def run(examples, predictor, provenance, folder):
    path = evaluate_examples(examples, predictor, provenance, folder, progress=False)
    return json.loads(path.read_text())


def test_copying_is_perfect_where_nothing_moves(make_example):
    (result,) = results_of(make_example(speed=0), CopyLast())
    assert result.outcome == "ok"
    assert result.continuation == dict.fromkeys(SCORED, 0.0) | {"mask_iou": 1.0}


def test_copying_is_imperfect_where_something_moves(make_example):
    (result,) = results_of(make_example(), CopyLast())
    assert 0 < result.continuation["mask_iou"] < 0.7
    assert result.continuation["wmae"] > 0.5


def test_black_has_the_worst_overlap_and_collapses(make_example):
    (result,) = results_of(make_example(), Black())
    assert result.continuation["mask_iou"] == 0
    assert result.continuation["collapse"] == 1
    assert result.continuation["color_tv"] == 1


def test_predictor_does_not_get_the_continuation(make_example):
    predictor = Answers(Failure("none", ""))
    example = make_example()
    score_example(example, predictor)
    (task,) = predictor.tasks
    assert not hasattr(task, "continuation")
    assert (task.horizon, task.framerate) == (10, 15)
    np.testing.assert_array_equal(task.prefix, example.prefix)


class Sealed(dict):
    """A row of which nothing may be read but what slices of the results need."""

    def __getitem__(self, name):
        allowed = ("family_id", "materials", "num_objects", "object_types")
        form = ("num_frames", "framerate", "resolution")
        assert name in (*allowed, *form, "motion", "ceiling"), name
        return super().__getitem__(name)


def test_a_task_carries_what_the_regime_gives_and_nothing_else(make_example):
    predictor = Answers(Failure("none", ""))
    example = make_example()
    score_example(replace(example, row=Sealed(example.row)), predictor)
    (task,) = predictor.tasks
    told = {"id", "prefix", "side_info", "regime", "horizon", "framerate", "form"}
    assert vars(task).keys() == told
    assert task.side_info == ""
    assert not re.search(r"p\d{4}", task.id)
    scene = next(iter(load_seeds().values()))
    told = replace(make_example(scene=scene.to_yaml()), regime=REGIMES["no_materials"])
    assert task_of(told).side_info == REGIMES["no_materials"].tell(scene)
    assert task_of(told).id == task.id


def test_an_oracle_is_handed_the_answers_and_results_say_so(
    make_example, provenance, tmp_path
):
    class Knows:
        name = "copy_last"

        def reveal(self, task, answers):
            assert answers.row["family_id"] == "p0001"
            return [Candidate(answers.continuation, task.prefix)]

    assert not provenance.knows_answers
    open_door = replace(provenance, knows_answers=True)
    summary = run([make_example()], Knows(), open_door, tmp_path)
    assert summary["continuation"]["mask_iou"]["valid"]["mean"] == 1.0
    table = (tmp_path / "summary.txt").read_text()
    assert table.startswith("copy_last (knows the answers) on tiny/test, frames_only")


CONTINUATION = np.zeros((10, 32, 32, 3), np.uint8)
PREFIX = CONTINUATION[:6]


@pytest.mark.parametrize(
    ("answers", "outcome", "reason"),
    [
        ([], "no_candidate", "no candidate"),
        ([RuntimeError("out of luck")], "predictor_error", "RuntimeError: out of luck"),
        ([Failure("timeout", "60 s")], "timeout", "60 s"),
        ([Candidate(CONTINUATION[1:])], "wrong_shape", r"(9, 32, 32, 3), must be (10,"),
        ([Candidate(CONTINUATION / 255)], "wrong_type", "float64, must be"),
        ([Candidate([[0]])], "wrong_type", "list, must be"),
        ([Candidate(CONTINUATION, PREFIX[1:])], "wrong_shape", "prefix has shape"),
    ],
)
def test_failure_is_a_typed_outcome_without_scores(
    make_example, answers, outcome, reason
):
    (result,) = results_of(make_example(), Answers(*answers))
    assert result.outcome == outcome
    assert reason in result.reason
    assert result.continuation is None
    assert result.prefix is None


def test_interruption_by_the_user_is_no_outcome(make_example):
    class Interrupted(CopyLast):
        def predict(self, task):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        score_example(make_example(), Interrupted())


def test_several_candidates_need_a_prefix_each(make_example):
    both = [Candidate(CONTINUATION, PREFIX), Candidate(CONTINUATION)]
    results = results_of(make_example(), Answers(*both))
    assert [result.outcome for result in results] == ["ok", "no_prefix"]
    assert [result.candidate for result in results] == [0, 1]


def test_candidate_is_selected_by_its_prefix(make_example, provenance, tmp_path):
    example = make_example()
    good_late = Candidate(example.continuation, PREFIX)
    good_early = Candidate(CONTINUATION, example.prefix)
    summary = run([example], Answers(good_late, good_early), provenance, tmp_path)
    assert summary["continuation"]["mask_iou"]["valid"]["mean"] == 0
    assert summary["prefix"]["mask_iou"]["valid"]["mean"] == 1
    assert (summary["samples"], summary["candidates"]) == (1, 2)


def test_failed_samples_count_at_the_worst_value(make_example, provenance, tmp_path):
    still = [make_example(f"p{number:04d}", speed=0) for number in range(4)]
    odd = {task_of(example).id for example in still[1::2]}

    class OnlyEven(CopyLast):
        def predict(self, task):
            if task.id in odd:
                return [Failure("odd", "an odd sample")]
            return super().predict(task)

    summary = run(still, OnlyEven(), provenance, tmp_path)
    assert summary["outcomes"] == {"odd": 2, "ok": 2}
    overlap = summary["continuation"]["mask_iou"]
    assert (overlap["valid"]["mean"], overlap["valid"]["n"]) == (1.0, 2)
    worst = overlap["failures_at_worst"]
    assert (worst["mean"], worst["n"]) == (0.5, 4)


def test_files_depend_on_the_results_alone(examples, provenance, tmp_path):
    for name in ("one", "two"):
        run(examples, CopyLast(), provenance, tmp_path / name)
    for file in ("results.jsonl", "summary.json", "summary.txt"):
        one, two = ((tmp_path / name / file).read_bytes() for name in ("one", "two"))
        assert one == two


def test_done_samples_are_not_computed_again(examples, provenance, tmp_path):
    run(examples[:3], CopyLast(), provenance, tmp_path)
    predictor = Answers(Failure("late", ""))
    summary = run(examples, predictor, provenance, tmp_path)
    assert [task.id for task in predictor.tasks] == [
        task_of(example).id for example in examples[3:]
    ]
    assert summary["outcomes"] == {"late": 2, "ok": 3}


def test_summary_covers_the_examples_asked_for(examples, provenance, tmp_path):
    run(examples, CopyLast(), provenance, tmp_path)
    assert run(examples[:2], CopyLast(), provenance, tmp_path)["samples"] == 2


KILLED_HALFWAY = """
import os, pickle, signal, sys
from pathlib import Path
from mpmworlds.baselines.simple.copy_last import CopyLast
from mpmworlds.baselines.evaluate import evaluate_examples
from mpmworlds.baselines.scoring import task_of

class Killed(CopyLast):
    def predict(self, task):
        if task.id == task_of(examples[3]).id:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().predict(task)

examples, provenance, folder = pickle.load(sys.stdin.buffer)
evaluate_examples(examples, Killed(), provenance, folder, progress=False)
"""


def test_killed_evaluation_goes_on_to_the_same_files(examples, provenance, tmp_path):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    run(examples, CopyLast(), provenance, whole)
    child = subprocess.run(
        [sys.executable, "-c", KILLED_HALFWAY],
        input=pickle.dumps((examples, provenance, killed)),
    )
    assert child.returncode == -signal.SIGKILL
    _, results = read_results(killed / "results.jsonl")
    assert [result.sample_id for result in results] == ["p0000", "p0001", "p0002"]
    run(examples, CopyLast(), provenance, killed)
    for file in ("results.jsonl", "summary.json"):
        assert (killed / file).read_bytes() == (whole / file).read_bytes()


def test_other_results_in_the_folder_are_an_error(examples, provenance, tmp_path):
    run(examples, CopyLast(), provenance, tmp_path)
    changed = type(provenance)(**vars(provenance) | {"split": "train"})
    with pytest.raises(ResultsError, match="split = 'test', must be 'train'"):
        run(examples, CopyLast(), changed, tmp_path)


def test_evaluation_of_nothing_is_an_error(provenance, tmp_path):
    with pytest.raises(ValueError, match="no sample to evaluate"):
        run([], CopyLast(), provenance, tmp_path)


def test_progress_is_shown_on_standard_error(
    make_example, provenance, tmp_path, capsys
):
    predictor = Answers(Failure("timeout", ""))
    evaluate_examples([make_example("p0042")], predictor, provenance, tmp_path)
    written = capsys.readouterr()
    assert "copy_last, frames_only" in written.err
    assert "1/1" in written.err
    assert written.out == ""


# ---- what is nobody's fault


class Flaky(CopyLast):
    """Whose server answers only now and then."""

    def __init__(self, *errors):
        self.errors = list(errors)

    def predict(self, task):
        if self.errors and (error := self.errors.pop(0)):
            raise error
        return super().predict(task)


@pytest.fixture
def no_pause(monkeypatch):
    monkeypatch.setattr(evaluate_module, "PAUSE", 0.0)


OUTAGES = [
    InfrastructureError("429: too many requests"),
    ConnectionError("refused"),
    MemoryError(),
    SandboxError("no layer"),
    OSError(28, "No space left on device"),
]


@pytest.mark.parametrize("error", OUTAGES, ids=lambda e: type(e).__name__)
def test_an_outage_is_tried_again_and_leaves_no_trace(
    error, examples, provenance, tmp_path, no_pause
):
    run(examples, CopyLast(), provenance, tmp_path / "calm")
    flaky = Flaky(None, error)
    summary = run(examples, flaky, provenance, tmp_path / "stormy")
    assert (summary["samples"], summary["troubles"]) == (5, {})
    for name in ("results.jsonl", "summary.json"):
        calm, stormy = ((tmp_path / d / name).read_bytes() for d in ("calm", "stormy"))
        assert calm == stormy


def test_a_lasting_outage_leaves_an_incomplete_run_that_says_so(
    examples, provenance, tmp_path, no_pause
):
    error = InfrastructureError("429: too many requests")
    summary = run(examples, Flaky(None, *[error] * 8), provenance, tmp_path)
    assert (summary["samples"], summary["expected"]) == (1, 5)
    assert summary["outcomes"] == {"ok": 1}
    assert summary["troubles"]["p0003"].endswith("429: too many requests")
    table = (tmp_path / "summary.txt").read_text()
    assert "INCOMPLETE: 4 samples are missing (p0001: InfrastructureError" in table
    assert run(examples, CopyLast(), provenance, tmp_path)["troubles"] == {}


def test_fewer_than_no_retries_are_refused_before_anything_is_made(
    examples, provenance, tmp_path
):
    told = r"retries = -1 \(--retry-failed\), must be at least 0: how often to go over"
    with pytest.raises(ValueError, match=told):
        evaluate_examples(
            examples, CopyLast(), provenance, tmp_path / "out", retries=-1
        )
    assert not (tmp_path / "out").exists()


def test_nothing_but_an_outage_has_a_summary(examples, provenance, tmp_path, no_pause):
    summary = run(examples, Flaky(*[OSError("gone")] * 20), provenance, tmp_path)
    assert (summary["samples"], summary["continuation"]) == (0, {})
    assert len(summary["troubles"]) == 5


# ---- programs and scenes

DRAWS = """
import numpy as np


def frames():
    for t in range(%(frames)d):
        if t == %(fails)d:
            raise RuntimeError("no such luck")
        open_ended = %(wait)f
        import time; time.sleep(open_ended)
        frame = np.zeros((32, 32, 3), np.uint8)
        frame[10:18, 2 + %(speed)d * t : 10 + %(speed)d * t] = (200, 40, 40)
        yield frame
"""


def program(speed=1, frames=16, fails=-1, wait=0.0):
    fields = {"speed": speed, "frames": frames, "fails": fails, "wait": wait}
    return ProgramText(DRAWS % fields)


def test_a_program_is_run_and_scored(make_example):
    (result,) = results_of(make_example(), Answers(program()))
    assert (result.outcome, result.reason) == ("ok", "")
    assert result.continuation["mask_iou"] == result.prefix["mask_iou"] == 1.0
    assert len(result.curves["mse"]) == 10


@pytest.mark.parametrize(
    ("text", "outcome"),
    [
        ("not Python at all", "syntax_error"),
        ("import nothing_like_it", "import_error"),
        (program(fails=3).text, "exception"),
        (program(frames=15).text, "wrong_shape"),
        ("def frames():\n    yield open('/etc/passwd').read()", "exception"),
    ],
)
def test_a_program_that_fails_has_its_outcome(make_example, text, outcome):
    (result,) = results_of(make_example(), Answers(ProgramText(text)))
    assert (result.outcome, result.continuation) == (outcome, None)


def test_a_scene_that_is_none_fails(make_example):
    (result,) = results_of(make_example(), Answers(SceneText("objects: [")))
    assert result.outcome == "invalid_scene"


def test_only_what_the_prefix_chooses_is_run_to_its_end(make_example):
    right, wrong, again = program(), program(2), program()
    later = program(fails=12)  # as good a prefix; it would fail after it
    answers = Answers(right, wrong, again, later)
    results = results_of(make_example(), answers)
    outcomes = [result.outcome for result in results]
    assert outcomes == ["ok", "passed_over", "passed_over", "passed_over"]
    assert results[0].continuation["mask_iou"] == 1.0
    assert results[1].prefix["mask_iou"] < results[0].prefix["mask_iou"] == 1.0
    assert results[2].prefix == results[0].prefix
    everything = score_example(make_example(), answers, How(selection="all")).results
    assert [r.outcome for r in everything] == ["ok", "ok", "ok", "exception"]
    assert everything[0].continuation == results[0].continuation


def test_the_choice_is_the_same_whether_losers_are_run_or_not(
    make_example, provenance, tmp_path
):
    speeds = [3, 0, 2, 1, 2, 5, 1]
    answers = Answers(*map(program, speeds), program(fails=2))
    example = make_example()
    means = []
    for selection in ("prefix", "all"):
        where = replace(provenance, selection=selection)
        path = evaluate_examples(
            [example], answers, where, tmp_path / selection, False, How(selection)
        )
        found = json.loads(path.read_text())["continuation"]
        means.append(
            {name: m["failures_at_worst"]["mean"] for name, m in found.items()}
        )
    assert means[0] == means[1]
    assert means[0]["mask_iou"] == 1.0


def test_a_program_that_wins_and_then_fails_is_a_failure(
    make_example, provenance, tmp_path
):
    answers = Answers(program(fails=12), program(2))
    summary = run([make_example()], answers, provenance, tmp_path)
    assert summary["continuation"]["mask_iou"]["failures_at_worst"]["mean"] == 0.0
    assert summary["continuation"]["mask_iou"]["valid"]["n"] == 0


def test_a_slow_program_gets_four_times_what_the_reference_takes(monkeypatch):
    monkeypatch.setattr(execution, "LEAST_TIME", 2.0)
    with execution.Runs(VideoForm(16, 15, 32), 6, "") as runs:
        monkeypatch.setattr(runs, "_time_of_reference", lambda: 2.0)
        slow = execution.Runnable(program(wait=0.25).text, trusted=False)  # 4 s
        assert len(runs.whole(slow)) == 16
        endless = execution.Runnable(program(wait=9.0).text, trusted=False)
        assert runs.whole(endless).outcome == "timeout"


def test_clips_of_predictions_are_kept_on_request(make_example, provenance, tmp_path):
    evaluate_examples(
        [make_example()], CopyLast(), provenance, tmp_path, False, How(clips=True)
    )
    clip = decode_mp4((tmp_path / "clips/p0001.mp4").read_bytes())
    assert clip.shape == (10, 32, 32, 3)
