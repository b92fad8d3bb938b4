"""Predictions that were made elsewhere, and submissions of them."""

import hashlib
import re

import numpy as np
import pytest
import yaml

from mpmworlds.baselines.predictions import (
    Predictions,
    PredictionsError,
    prediction_files,
    read_prediction,
)
from mpmworlds.baselines.protocol import Candidate, Failure, ProgramText, SceneText
from mpmworlds.baselines.scoring import score_example, task_of
from mpmworlds.baselines.submission import SubmissionError, check, pack
from mpmworlds.sim.run.encode import encode_unchecked

CARD = {
    "system": "Ours",
    "contact": "us@example.org",
    "config": "tiny",
    "split": "test",
    "regime": "frames_only",
    "kind": "videos",
    "fps": 15,
    "resolution": 256,
    "candidates": 1,
    "cost": "2 GPU hours",
    "hardware": "one GPU",
}


@pytest.fixture
def task(make_example):
    return task_of(make_example())


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "predictions"
    place.mkdir()
    return place


def save(path, frames):
    path.parent.mkdir(exist_ok=True)
    np.save(path, frames)


def test_a_prediction_is_found_by_its_sample(folder, make_example):
    example = make_example("p0001")
    save(folder / "p0001.npy", example.continuation)
    (result,) = score_example(example, Predictions(str(folder))).results
    assert result.continuation["mask_iou"] == 1.0
    (other,) = score_example(make_example("p0002"), Predictions(str(folder))).results
    assert (other.outcome, other.continuation) == ("missing", None)


def test_a_whole_clip_brings_its_own_prefix(folder, make_example):
    example = make_example("p0001")
    for number in range(2):
        whole = np.concatenate([example.prefix, example.continuation])
        save(folder / f"p0001/{number}.npy", whole if number else whole[::-1])
    results = score_example(example, Predictions(str(folder))).results
    assert [r.prefix["mask_iou"] < 1 for r in results] == [True, False]
    assert results[1].continuation["mask_iou"] == 1.0


def test_texts_are_programs_and_scenes(folder, task):
    (folder / "p0001.py").write_text("print(1)\n")
    (folder / "p0002.yaml").write_text("schema: none\n")
    predictions = Predictions(str(folder))
    assert predictions.look_up("p0001", task) == [ProgramText("print(1)\n")]
    assert predictions.look_up("p0002", task) == [SceneText("schema: none\n")]


def test_a_video_is_decoded_and_held_to_its_rate(folder, task, make_example):
    frames = make_example().continuation
    (folder / "p0001.mp4").write_bytes(encode_unchecked(frames, 15))
    found = read_prediction(folder / "p0001.mp4", task)
    assert isinstance(found, Candidate)
    assert found.continuation.shape == frames.shape
    (folder / "p0001.mp4").write_bytes(encode_unchecked(frames, 30))
    found = read_prediction(folder / "p0001.mp4", task)
    assert found.outcome == "wrong_type"
    assert "30 frames per second, must have 15; reduce it" in found.reason


@pytest.mark.parametrize(
    ("frames", "told"),
    [
        (np.zeros((10, 32, 32, 3)), "float64, must be .* multiply by 255 and round"),
        (np.full((10, 32, 32, 3), np.nan), "it has NaN"),
        (np.full((10, 32, 32, 3), 77.5), "; round"),
        (np.zeros((10, 3, 32, 32), np.uint8), "put the channels last"),
        (np.zeros((9, 32, 32, 3), np.uint8), "look at the frame rate"),
        (np.zeros((10, 64, 64, 3), np.uint8), r"\(10, 64, 64, 3\), must be"),
        (np.zeros((10, 32, 32), np.uint8), "must be"),
    ],
)
def test_frames_that_are_none_are_told_what_to_do(folder, make_example, frames, told):

    save(folder / "p0001.npy", frames)
    (result,) = score_example(make_example(), Predictions(str(folder))).results
    assert result.continuation is None
    assert re.search(told, result.reason)


def test_a_file_that_is_no_array_is_a_failure(folder, task):
    (folder / "p0001.npy").write_bytes(b"nothing of the kind")
    assert isinstance(read_prediction(folder / "p0001.npy", task), Failure)


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ([], "no predictions; name them ID.EXT"),
        (["best.npy"], "best"),
        (["p0001/1.npy"], "must be numbered 0, 1, 2"),
        (["p0001/0.npy", "p0001/2.npy"], "must be numbered"),
        (["p0001.npy", "p0001/0.npy"], "another prediction beside it"),
    ],
)
def test_a_folder_that_is_none_is_an_error(folder, files, told):
    for name in files:
        save(folder / name, np.zeros(1))
    with pytest.raises(PredictionsError, match=told):
        prediction_files(folder)


def test_what_is_predicted_tells_predictions_apart(folder, tmp_path):
    save(folder / "p0001.npy", np.zeros(1))
    one = Predictions(str(folder)).configuration
    folder.rename(tmp_path / "elsewhere")
    assert Predictions(str(tmp_path / "elsewhere")).configuration == one
    save(tmp_path / "elsewhere/p0001.npy", np.ones(1))
    assert Predictions(str(tmp_path / "elsewhere")).configuration != one


# ---- submissions


@pytest.fixture
def card(tmp_path):
    def write(**changes):
        path = tmp_path / "card.yaml"
        fields = {k: v for k, v in (CARD | changes).items() if v is not None}
        path.write_text(yaml.safe_dump(fields))
        return path

    return write


IDS = {"p0001", "p0002-c1"}


@pytest.fixture
def whole(folder):
    for name in IDS:
        save(folder / f"{name}.npy", np.zeros(3))
    return folder


def test_a_whole_submission_is_packed_and_checked(whole, card, tmp_path):
    out = tmp_path / "mine"
    assert pack(whole, card(), out, IDS) == ["Ours: 2 samples of 2"]
    assert check(out, IDS) == ["Ours: 2 samples of 2"]
    assert (out / "predictions/p0001.npy").read_bytes() == (
        whole / "p0001.npy"
    ).read_bytes()
    with pytest.raises(SubmissionError, match="is there already"):
        pack(whole, card(), out, IDS)


def test_a_partial_one_is_refused_unless_it_says_so(whole, card, tmp_path):
    (whole / "p0001.npy").unlink()
    with pytest.raises(SubmissionError, match=r"1 of 2 samples .* p0001; predict"):
        pack(whole, card(), tmp_path / "mine", IDS)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["card.yaml", "predictions"]
    told = pack(whole, card(), tmp_path / "mine", IDS, partial=True)
    assert told == ["Ours: 1 samples of 2, 1 missing"]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"contact": None}, "contact: Field required"),
        ({"fps": "fast"}, "fps: "),
        ({"candidates": 2}, "1 candidates, the card says 2"),
        ({"kind": "programs"}, "the card says programs"),
        ({"regime": "mind_reading"}, "must be one of"),
        ({"motto": "win"}, "motto: "),
    ],
)
def test_a_card_that_is_none_is_told_why(whole, card, tmp_path, changes, told):
    with pytest.raises(SubmissionError, match=told):
        pack(whole, card(**changes), tmp_path / "mine", IDS)
    assert not (tmp_path / "mine").exists()


def test_a_missing_card_is_told_what_it_has(whole, tmp_path):
    with pytest.raises(SubmissionError, match="# what it ran on"):
        pack(whole, tmp_path / "none.yaml", tmp_path / "mine", IDS)


def test_samples_of_elsewhere_and_changed_files_are_found(whole, card, tmp_path):
    with pytest.raises(SubmissionError, match="p0002-c1: not among the 1 samples"):
        pack(whole, card(), tmp_path / "mine", {"p0001"})
    pack(whole, card(), tmp_path / "mine", IDS)
    np.save(tmp_path / "mine/predictions/p0001.npy", np.ones(3))
    with pytest.raises(SubmissionError, match="has changed; pack it again"):
        check(tmp_path / "mine", IDS)
    (tmp_path / "mine/predictions/p0001.npy").unlink()
    with pytest.raises(SubmissionError, match="not as SHA256SUMS says"):
        check(tmp_path / "mine", IDS)


def test_checksums_are_those_of_the_command_sha256sum(whole, card, tmp_path):
    pack(whole, card(), tmp_path / "mine", IDS)
    line = (tmp_path / "mine/SHA256SUMS").read_text().splitlines()[0]
    digest, name = line.split("  ")
    data = (tmp_path / "mine" / name).read_bytes()
    assert hashlib.sha256(data).hexdigest() == digest
