"""Training: what it sees, that it goes on where it was stopped, what it refuses."""

import json
import shutil

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("accelerate")

from safetensors.torch import load_file  # noqa: E402

from mpmworlds.baselines.evaluate import evaluate  # noqa: E402
from mpmworlds.baselines.learned.notes import NOTE, CheckpointError  # noqa: E402
from mpmworlds.baselines.registry import predictor_named  # noqa: E402
from mpmworlds.baselines.results import read_results  # noqa: E402
from mpmworlds.baselines.small.learning.windows import LabelFiles, Windows  # noqa: E402
from mpmworlds.baselines.small.settings import TrainingSettings  # noqa: E402
from mpmworlds.baselines.small.slots import UNKNOWN  # noqa: E402
from mpmworlds.baselines.small.training import train  # noqa: E402
from mpmworlds.cli import main  # noqa: E402
from mpmworlds.loaders.export.folder import Source  # noqa: E402
from mpmworlds.metrics.reduction import prefix_length  # noqa: E402

TINY = TrainingSettings.read("tiny", {"held_out": 0, "device": "cpu"})


@pytest.fixture(scope="module")
def source(small):
    return Source(small.release, "tiny", "train", "frames_only")


@pytest.fixture(scope="module")
def trained(source, tmp_path_factory):
    """Folder of a training that was not disturbed."""
    folder = tmp_path_factory.mktemp("trained")
    train(source, TINY, folder, progress=False)
    return folder


def weights_of(folder):
    return load_file(folder / "model.safetensors")


def log_of(folder):
    return [json.loads(line) for line in (folder / "log.jsonl").open()]


def equal(one, other):
    return one.keys() == other.keys() and all(
        torch.equal(one[name], other[name]) for name in one
    )


class StoppedError(Exception):
    """The training was stopped from outside."""


def test_windows_follow_from_seed_and_number(source, tmp_path):
    files = LabelFiles(source.load(), tmp_path)
    windows = Windows(files, [0], [1.0], 10, 7, flips=True)
    again = Windows(
        LabelFiles(source.load(), tmp_path / "b"), [0], [1.0], 10, 7, flips=True
    )
    first = [windows[k] for k in (3, 1, 2)]
    second = [again[k] for k in (1, 2, 3)]
    for one, other in zip([first[1], first[2], first[0]], second, strict=True):
        np.testing.assert_array_equal(one.labels, other.labels)
    assert any((windows[k].labels != windows[0].labels).any() for k in range(1, 9))


def test_a_window_is_what_a_clip_shows(source, tmp_path):
    from mpmworlds.baselines.small.slots import Slots

    examples = source.load()
    window = LabelFiles(examples, tmp_path).window(0, 5, 12)
    clip = np.concatenate([examples[0].prefix, examples[0].continuation])
    slots = Slots.of(clip[: prefix_length(15)])
    assert not (window.labels == UNKNOWN).any()
    np.testing.assert_array_equal(slots.frames(window.labels), clip[5:17])


def test_a_window_longer_than_a_clip_is_told(source, tmp_path):
    windows = Windows(
        LabelFiles(source.load(), tmp_path), [0], [1.0], 99, 0, flips=False
    )
    with pytest.raises(ValueError, match="has 40 frames, a window needs 99"):
        windows[0]


def test_the_same_seed_gives_the_same_weights(source, trained, tmp_path):
    again = train(source, TINY, tmp_path / "again", progress=False)
    assert equal(weights_of(again), weights_of(trained))
    assert log_of(again) == log_of(trained)
    other = TINY.model_copy(update={"seed": 1})
    different = train(source, other, tmp_path / "other", progress=False)
    assert not equal(weights_of(different), weights_of(trained))


@pytest.mark.parametrize("stopped_at", [2, 4])
def test_a_stopped_training_goes_on_as_if_it_had_not(
    source, trained, tmp_path, monkeypatch, stopped_at
):
    from mpmworlds.baselines.small.learning import progress

    noted = progress.Progress.note

    def stop(self, step, told):
        noted(self, step, told)
        if step == stopped_at:
            raise StoppedError

    monkeypatch.setattr(progress.Progress, "note", stop)
    with pytest.raises(StoppedError):
        train(source, TINY, tmp_path, progress=False)
    monkeypatch.undo()
    assert not (tmp_path / "model.safetensors").exists()
    train(source, TINY, tmp_path, progress=False)
    assert equal(weights_of(tmp_path), weights_of(trained))
    assert log_of(tmp_path) == log_of(trained)


def test_a_folder_of_another_training_is_refused(source, trained):
    other = TINY.model_copy(update={"batch": 3})
    with pytest.raises(ValueError, match=r"holds another training .*batch = 2, now 3"):
        train(source, other, trained, progress=False)


def test_a_trained_model_is_evaluated_and_reported(small, trained, tmp_path, capsys):
    checkpoint = f"checkpoint={trained}"
    given = ["--release", str(small.release), "--split", "test", "--workers", "1"]
    folders = []
    for name, options in (
        ("small", ["--predictor-option", checkpoint]),
        ("copy_last", []),
    ):
        folders.append(str(tmp_path / name))
        arguments = ["--predictor", name, *options, *given, "--out", folders[-1]]
        assert main(["evaluate", *arguments]) == 0
    provenance, results = read_results(tmp_path / "small" / "results.jsonl")
    assert {result.outcome for result in results} == {"ok"}
    assert all(result.prefix is not None for result in results)
    assert provenance.options["checkpoint"] == ""
    assert main(["report", *folders, "--out", str(tmp_path / "report")]) == 0
    assert "small" in (tmp_path / "report" / "data.js").read_text()
    capsys.readouterr()


def test_a_model_that_is_told_something_wants_to_be_told(small, tmp_path, capsys):
    told = ["--regime", "full_config", "--release", str(small.release)]
    settings = ["--recipe", "tiny", "--set", "steps=2", "--set", "device=cpu"]
    out = tmp_path / "told"
    assert main(["train", "small", *told, *settings, "--out", str(out)]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    options = {"checkpoint": str(out), "device": "cpu"}
    where = small.release, "small", "test"
    with pytest.raises(ValueError, match="must be one of \\['full_config'\\]"):
        evaluate(*where, tmp_path / "a", options=options, progress=False)
    evaluate(
        *where,
        tmp_path / "b",
        options=options,
        regime="full_config",
        workers=1,
        progress=False,
    )
    assert (tmp_path / "b" / "summary.json").is_file()


def test_a_checkpoint_of_another_version_is_refused(trained, tmp_path):
    folder = tmp_path / "model"
    shutil.copytree(trained, folder)
    note = json.loads((folder / NOTE).read_text())
    (folder / NOTE).write_text(json.dumps(note | {"version": 99}))
    model = predictor_named("small", {"checkpoint": str(folder), "device": "cpu"})
    with pytest.raises(CheckpointError, match=r"version 99, must be 1; train it again"):
        _ = model.configuration
    (folder / NOTE).write_text(json.dumps(note | {"family": "other"}))
    with pytest.raises(CheckpointError, match="is a model other, must be small"):
        _ = model.configuration


def test_what_is_no_checkpoint_is_told(tmp_path):
    with pytest.raises(ValueError, match="kept = 2, must be from 0 to 1"):
        predictor_named("small", {"checkpoint": str(tmp_path), "kept": 2})
    model = predictor_named("small", {"checkpoint": str(tmp_path), "device": "cpu"})
    with pytest.raises(CheckpointError, match="mpmworlds train small --out"):
        _ = model.regimes


def test_recipes_are_settings_and_errors_name_them(capsys):
    for recipe in TrainingSettings.recipes():
        assert main(["train", "small", "--recipe", recipe, "--show"]) == 0
    capsys.readouterr()
    assert main(["train", "small", "--set", "batch=0", "--show"]) == 2
    assert "batch = 0" in capsys.readouterr().err
    assert main(["train", "small", "--recipe", "none", "--show"]) == 2
    assert "cpu" in capsys.readouterr().err
    assert main(["train", "smell"]) == 2
    assert "must be one of" in capsys.readouterr().err
