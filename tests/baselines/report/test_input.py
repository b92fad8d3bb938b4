"""What cannot be compared is refused in a line that says what to do."""

import pytest

from mpmworlds.baselines.report.board import Split, boards, read_systems
from mpmworlds.baselines.report.write import write_report
from tests.baselines.made_results import result, summarise, write


def alone(*samples):
    return [[result(sample, 0.5)] for sample in samples]


def refused(command, tmp_path, *arguments):
    """The one line with which the verb refuses its arguments."""
    status, out, err = command("report", *arguments, "--out", tmp_path / "out")
    assert (status, out) == (2, "")
    assert not (tmp_path / "out").exists()
    (line,) = err.splitlines()
    return line


@pytest.fixture
def first(tmp_path):
    return write(tmp_path / "first", alone("p0001", "p0002"))


def test_folder_without_results(command, tmp_path):
    (tmp_path / "empty").mkdir()
    line = refused(command, tmp_path, tmp_path / "empty")
    assert line.endswith(
        "holds no results.jsonl; name a folder that `mpmworlds "
        "evaluate --out` has written"
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"release_sha256": "other"}, "of release other, must be that of"),
        ({"metrics_version": "mpmworlds-metrics/1"}, "scored by mpmworlds-metrics/1"),
        ({"constants_sha256": "other"}, "scored with constants other, must be those"),
    ],
)
def test_other_release_or_metrics(command, first, tmp_path, changes, message):
    changes = {"predictor": "black"} | changes
    second = write(tmp_path / "second", alone("p0001", "p0002"), **changes)
    line = refused(command, tmp_path, first, second)
    assert f"{second}: {message}" in line


def test_same_system_twice(command, first, tmp_path):
    again = write(tmp_path / "again", alone("p0001", "p0002"))
    line = refused(command, tmp_path, first, again)
    assert "both are copy_last, frames_only; name one of them" in line


def test_two_configurations_of_one_predictor_are_named_apart(first, tmp_path):
    other = write(tmp_path / "other", alone("p0001", "p0002"), predictor_sha256="other")
    with pytest.raises(ValueError, match="name them apart, NAME=FOLDER"):
        boards(read_systems([str(first), str(other)]))
    (board,) = boards(read_systems([str(first), f"slower={other}"]))
    assert [system.name for system in board.systems] == ["copy_last", "slower"]


def test_different_samples_are_named_and_compared_only_if_asked(
    command, first, tmp_path
):
    second = write(tmp_path / "b", alone("p0002", "p0003"), predictor="black")
    line = refused(command, tmp_path, first, second)
    assert f"only {second} has p0003; only {first} has p0001" in line
    assert line.endswith("compare the common ones with --common")
    systems = read_systems([str(first), str(second)])
    (board,) = boards(systems, common=True)
    assert board.samples == ["p0002"]
    assert board.expected == 3
    assert set(board.evaluated.values()) == {2}


def test_no_common_sample(command, first, tmp_path):
    second = write(tmp_path / "b", alone("p0003"), predictor="black")
    line = refused(command, tmp_path, first, second, "--common")
    assert "no sample is common to all systems" in line


def test_run_that_was_stopped_in_a_sample(command, tmp_path):
    candidates = [
        result("p0001", 0.5, prefix=0.5, candidate=k, candidates=2) for k in range(2)
    ]
    folder = write(tmp_path / "a", [candidates])
    path = folder / "results.jsonl"
    path.write_bytes(path.read_bytes().splitlines(keepends=True)[0])
    line = refused(command, tmp_path, folder)
    assert "incomplete: p0001 has candidates [0], must be 0 to 1" in line


def test_run_that_went_on_after_its_summary(command, first, tmp_path):
    summarise(first, 1)
    line = refused(command, tmp_path, first)
    assert "incomplete: 2 samples in results.jsonl, 1 in summary.json" in line


def test_summary_that_is_none(command, first, tmp_path):
    (first / "summary.json").write_text("{}")
    assert "summary.json: is no summary" in refused(command, tmp_path, first)


def test_run_without_a_summary_is_noted(first, tmp_path, monkeypatch):
    (first / "summary.json").unlink()
    monkeypatch.setattr("mpmworlds.baselines.report.write.drawn", lambda *_: ())
    notes = write_report([str(first)], tmp_path / "out").data["notes"]
    assert notes[0].startswith("copy_last, frames_only on test: no summary.json beside")


def test_results_of_less_than_the_split_are_incomplete(first):
    (system,) = read_systems([str(first)])
    splits = {("tiny", "test"): Split(["p0001", "p0002", "p0003"], 15)}
    with pytest.raises(ValueError, match="incomplete: 2 of 3 samples of the split, p0"):
        boards([system], splits)
    (board,) = boards([system], splits, common=True)
    assert (len(board.samples), board.expected) == (2, 3)


def test_results_of_another_split_than_the_release_has(first):
    (system,) = read_systems([str(first)])
    with pytest.raises(ValueError, match="have p0002, which is no sample of it"):
        boards([system], {("tiny", "test"): Split(["p0001"], 15)})


def test_other_release_than_the_results_are_of(command, first, release, tmp_path):
    line = refused(command, tmp_path, first, "--release", release)
    assert f"but that of {release} is" in line
    line = refused(command, tmp_path, first, "--release", tmp_path)
    assert f"{tmp_path}: is no release; name the folder that" in line


def test_candidate_that_was_passed_over_but_is_chosen(tmp_path):
    best = result("p0001", None, prefix=0.9, outcome="passed_over", candidates=2)
    best.prefix.update(result("p0001", 0.9).continuation)
    other = result("p0001", 0.5, prefix=0.5, candidate=1, candidates=2)
    (system,) = read_systems([str(write(tmp_path / "a", [[best, other]]))])
    with pytest.raises(ValueError, match="0 was passed over, but mse chooses"):
        system.chosen("mse")
