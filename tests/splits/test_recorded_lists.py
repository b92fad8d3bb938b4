"""Recorded lists: byte-stable, checked, and any tampering is named."""

import pytest

from mpmworlds.splits import (
    ListParams,
    SplitListError,
    SplitParams,
    assign,
    check,
    compute_lists,
    read_lists,
    write_lists,
)

PARAMS = SplitParams("mpmworlds-splits-1", 0.3, 0.3)
IDS = [f"p{p:04d}{tail}" for p in range(20) for tail in ("", "-c0", "-c1", "-c1-n03")]

LISTS = ListParams(
    "lists-1",
    {"test": 8, "modification_validation": 4},
    {"seed": 8, "parent": 8, "child": 4, "perturbation": 1},
    {"mini": {"train": 12, "test": 3, "modification_validation": 2}},
)


@pytest.fixture
def recorded(tmp_path):
    write_lists(tmp_path / "recorded", assign(IDS, PARAMS))
    return tmp_path / "recorded"


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def first_of(folder, split):
    return (folder / f"{split}.txt").read_text().splitlines()[0]


def move_first(folder, source, target):
    """Move an id between two list files as an editor would, and return it."""
    moved, *rest = (folder / f"{source}.txt").read_text().splitlines(keepends=True)
    (folder / f"{source}.txt").write_text("".join(rest))
    with (folder / f"{target}.txt").open("a") as stream:
        stream.write(moved)
    return moved.strip()


def test_reading_inverts_writing(recorded):
    assert read_lists(recorded) == assign(IDS, PARAMS)


def test_files_depend_on_the_sets_alone(recorded, tmp_path):
    shuffled = {
        split: reversed(members)
        for split, members in reversed(assign(IDS, PARAMS).items())
    }
    write_lists(tmp_path / "again", shuffled)
    assert contents(tmp_path / "again") == contents(recorded)


def test_untouched_lists_hold(recorded):
    assert check(recorded, reversed(IDS), PARAMS) == []


def test_moved_id_is_named(recorded):
    moved = move_first(recorded, "test", "train")
    problems = check(recorded, IDS, PARAMS)
    assert f"{moved}: recorded in train, belongs to test" in problems
    assert len([line for line in problems if "sha256" in line]) == 2
    with pytest.raises(SplitListError, match="sha256"):
        read_lists(recorded)


def test_moved_id_is_named_even_with_new_checksums(recorded):
    lists = read_lists(recorded)
    moved = lists["test"].pop()
    lists["train"].append(moved)
    write_lists(recorded, lists)
    problems = check(recorded, IDS, PARAMS)
    assert problems == [f"{moved}: recorded in train, belongs to test"]


def test_other_parameters_are_noticed(recorded):
    other = SplitParams("another salt", 0.3, 0.3)
    assert check(recorded, IDS, other)


def test_absent_and_additional_ids_are_named(recorded):
    lists = read_lists(recorded)
    dropped = lists["train"].pop(0)
    lists["test"].append("p7777")
    write_lists(recorded, lists)
    problems = check(recorded, IDS, PARAMS)
    assert problems == [
        f"{dropped}: not recorded, belongs to train",
        "p7777: recorded in test, not among the samples",
    ]


def test_id_in_two_lists_is_named(recorded):
    lists = read_lists(recorded)
    twice = lists["train"][0]
    lists["test"].append(twice)
    write_lists(recorded, lists)
    assert f"{twice}: recorded twice, in train and test" in check(recorded, IDS, PARAMS)


def test_missing_and_unnamed_files_are_named(recorded):
    (recorded / "test.txt").rename(recorded / "tset.txt")
    problems = check(recorded, IDS, PARAMS)
    assert any("test.txt: missing" in line for line in problems)
    assert any("tset.txt: SHA256SUMS does not name it" in line for line in problems)


@pytest.mark.parametrize("line", ["no checksum", f"{'0' * 64}  ../test.txt"])
def test_damaged_checksums_are_named(recorded, line):
    with (recorded / "SHA256SUMS").open("a") as stream:
        stream.write(line + "\n")
    assert "SHA256SUMS" in check(recorded, IDS, PARAMS)[0]
    with pytest.raises(SplitListError, match="SHA256SUMS"):
        read_lists(recorded)


@pytest.fixture
def chosen(tmp_path):
    write_lists(tmp_path / "chosen", compute_lists(IDS, PARAMS, LISTS))
    return tmp_path / "chosen"


def test_chosen_lists_are_recorded_beside_the_splits(chosen):
    assert read_lists(chosen) == compute_lists(IDS, PARAMS, LISTS)
    assert check(chosen, IDS, PARAMS, LISTS) == []


def test_changed_choice_is_named(chosen):
    lists = read_lists(chosen)
    dropped = lists["mini_train"].pop(0)
    taken = next(i for i in lists["train"] if i not in lists["mini_train"] + [dropped])
    lists["mini_train"].append(taken)
    write_lists(chosen, lists)
    assert check(chosen, IDS, PARAMS, LISTS) == [
        f"{taken}: recorded in mini_train, not chosen",
        f"{dropped}: not recorded in mini_train, but chosen",
    ]


def test_id_twice_in_a_chosen_list_is_named(chosen):
    path = chosen / "evaluation_test.txt"
    first = first_of(chosen, "evaluation_test")
    path.write_text(first + "\n" + path.read_text())
    problems = check(chosen, IDS, PARAMS, LISTS)
    assert f"{first}: twice in evaluation_test" in problems


def test_list_that_the_parameters_do_not_ask_for_is_named(chosen):
    problems = check(chosen, IDS, PARAMS)
    assert len(problems) == 5
    assert all("ask for no such list" in line for line in problems)


def test_chosen_list_that_is_not_recorded_is_named(recorded):
    problems = check(recorded, IDS, PARAMS, LISTS)
    assert len(problems) == 5
    assert problems[0].endswith("SHA256SUMS: does not name evaluation_test.txt")


def test_split_without_a_list_is_named(recorded, tmp_path):
    lists = read_lists(recorded)
    del lists["test"]
    write_lists(tmp_path / "two", lists)
    problems = check(tmp_path / "two", IDS, PARAMS)
    assert "does not name test.txt" in problems[0]


@pytest.mark.parametrize("name", ["Test", "../test", "modification-validation", ""])
def test_name_that_is_no_plain_word_is_an_error(tmp_path, name):
    with pytest.raises(ValueError, match="split list"):
        write_lists(tmp_path, {name: []})
    assert list(tmp_path.iterdir()) == []


def test_repeated_id_is_an_error(tmp_path):
    with pytest.raises(ValueError, match="'p0001' occurs twice"):
        write_lists(tmp_path, {"train": ["p0001", "p0001"]})


def test_failed_write_leaves_the_old_file(recorded, monkeypatch):
    before = contents(recorded)

    def fail(descriptor):
        raise OSError("no space left")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OSError, match="no space"):
        write_lists(recorded, {"train": ["p0001"]})
    assert contents(recorded) == before
