"""Rows that do not say what their ids say, and torn lineages, are found."""

import pytest

from mpmworlds.splits.lineage import lineage_findings
from tests.made_up import SPLIT, changed, records

SOUND = records()


def problems(corpus):
    return list(lineage_findings(corpus, SPLIT))


def rules(corpus):
    return {problem.rule for problem in problems(corpus)}


def test_sound_lineage_has_no_problem():
    assert problems(SOUND) == []


def test_family_in_test_and_elsewhere_is_found():
    (found, *_) = [
        problem
        for problem in problems(changed(["p0001-c0", "p0001-c0-n00"], split="train"))
        if problem.rule == "family crosses splits"
    ]
    assert found.ids == ("p0001", "p0001-c0")
    assert "family p0001 is in test, train" in str(found)


def test_whole_family_in_the_wrong_split_is_found():
    family = [record.id for record in SOUND if record.family_id == "p0001"]
    found = problems(changed(family, split="train"))
    assert [(problem.rule, *problem.ids) for problem in found] == [
        ("split", sample_id) for sample_id in family
    ]
    assert "is 'train', must be 'test' by its id" in str(found[0])


def test_child_apart_from_its_perturbations_is_found():
    found = problems(changed(["p0000-c1-n00"], split="train"))
    assert (
        "p0000-c1, p0000-c1-n00: template crosses splits: p0000-c1 and its"
        in "\n".join(map(str, found))
    )


def test_split_that_there_is_not_is_found():
    assert "split" in rules(changed(["p0002"], split="validation"))


@pytest.mark.parametrize(
    ("sample_id", "columns", "line"),
    [
        ("p0000-c1", {"kind": "parent"}, "kind: is 'parent', must be 'child' by"),
        ("p0000-c1", {"parent_id": "p0001"}, "parent_id: is 'p0001', must be 'p0000'"),
        ("p0000-c1-n00", {"parent_id": "p0000"}, "must be 'p0000-c1' by its id"),
        ("p0000", {"parent_id": "s05"}, "parent_id: is 's05', must be ''"),
        ("p0000-n00", {"family_id": "p0002"}, "family_id: is 'p0002', must be 'p0000'"),
        ("p0000-c0", {"seeds": ("s09",)}, "must be those of p0000"),
        ("p0000-c0-n00", {"seeds": ()}, r"seeds: are [], must be those of p0000-c0"),
        ("p0002", {"seeds": ()}, "seeds: are [], must be at least one"),
        ("s05", {"seeds": ("s06_slow_press",)}, "must be itself alone"),
    ],
    ids=str,
)
def test_lineage_that_is_not_the_id_s_is_found(sample_id, columns, line):
    found = problems(changed([sample_id], **columns))
    assert [str(p) for p in found if p.ids == (sample_id,) and line in str(p)]


def test_origin_that_is_not_there_is_found():
    without = [record for record in SOUND if record.id != "p0002-c1"]
    (found,) = problems(without)
    assert (found.rule, found.ids) == ("ancestor", ("p0002-c1-n00",))
    assert "p0002-c1 is not in the corpus" in found.detail


def test_id_that_occurs_twice_is_found():
    (found,) = problems([*SOUND, SOUND[0]])
    assert str(found) == "p0000: repeated id: 2 rows have it, must be one"


def test_id_out_of_the_grammar_is_found():
    assert rules([*SOUND, SOUND[0]._replace(id="p12")]) == {"id"}
