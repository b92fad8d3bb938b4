"""Conditions mean what they say and can do nothing else."""

from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest
from mpmworlds.builder.plan.select import SelectionError, matching, select


@pytest.fixture(scope="module")
def row(make_row):
    return replace(
        make_row("p0123-c4", "train", ""),
        edit='{"operator": "swap_material"}',
        materials=("liquid", "sand"),
        object_types=("dynamic_body", "emitter"),
        seeds=("s01", "s07"),
        num_objects=3,
        num_materials=2,
        motion=0.25,
    )


@pytest.mark.parametrize(
    ("where", "answer"),
    [
        ("'sand' in materials", True),
        ("'snow' in materials", False),
        ("'snow' not in materials", True),
        ("list_has_any(materials, ['snow', 'sand'])", True),
        ("materials = ['liquid', 'sand']", True),
        ("'emitter' in object_types", True),
        ("num_objects >= 3", True),
        ("num_objects == 3.0", True),
        ("num_objects between 1 and 2", False),
        ("num_materials < num_objects", True),
        ("motion > 0.2", True),
        ("ceiling.mask_iou is null", True),
        ("kind in ('child', 'parent')", True),
        ("id >= 'p0100' and not family_id = 'p0124'", True),
        ("edit = 'swap_material'", True),
        ("'snow' in materials and num_objects > 9 or kind = 'child'", True),
        ("'snow' in materials and (num_objects > 9 or kind = 'child')", False),
        ("contains(scene, 'schema')", False),
        ("  'sand' in materials\n", True),
    ],
)
def test_a_condition_means_what_it_says(where, answer, row):
    if answer:
        assert matching([row], where) == {"p0123-c4"}
    else:
        with pytest.raises(SelectionError, match="none of 1 rows satisfies"):
            matching([row], where)


@pytest.mark.parametrize(
    ("where", "reason"),
    [
        ("", "without selection list"),
        ("num_objects >", "syntax error"),
        (
            "material = 'sand'",
            '"material" not found .* Candidate bindings: "materials"',
        ),
        ("kind = child", 'column "child" not found'),
        ("num_objects = 'three'", "Could not convert string 'three' to INT32"),
        ("true; drop table rows", "Cannot have any modifiers"),
        ("true limit 1", "Cannot have any modifiers"),
        ("true) union select 1", "syntax error"),
        ("id in (select id from 'manifest.parquet')", "file system operations are dis"),
        ("(select count(*) from row) > 0", "name row does not exist"),
        ("read_text('/etc/passwd') = ''", "table function"),
        ("(" * 9999, "syntax error|too|depth"),
    ],
)
def test_anything_else_is_refused_with_what_is_wrong(where, reason, row):
    pattern = rf"(?s)is no condition on rows: .*({reason}).*; columns: id, kind,"
    with pytest.raises(SelectionError, match=pattern):
        matching([row], where)


def test_a_condition_reads_no_file_and_sets_nothing(row, tmp_path):
    file = tmp_path / "secret.csv"
    file.write_text("a\n1\n")
    for where in (
        f"(select count(*) from '{file}') = 1",
        f"(select count(*) from read_csv('{file}')) = 1",
    ):
        with pytest.raises(SelectionError, match="disabled by configuration"):
            matching([row], where)


@given(st.text(max_size=40))
def test_any_text_is_a_condition_or_a_selection_error(row, text):
    with suppress(SelectionError):
        matching([row], text)


# ---- selections


@pytest.fixture(scope="module")
def rows(corpus):
    return corpus.rows


def ids(rows):
    return [row.id for row in rows]


def test_without_a_wish_everything_is_selected_in_order(rows):
    assert select(rows) == rows


def test_all_wishes_must_hold(rows):
    assert ids(select(rows, ["p0001", "p0000", "p0002"], split="train")) == [
        "p0000",
        "p0001",
    ]
    assert ids(select(rows, split="train", kind="child")) == ["p0000-c0"]
    assert ids(select(rows, kind="child", where="split != 'train'")) == ["p0000-c1"]
    assert select(rows, ["p0000"], split="test") == []


def test_limit_keeps_the_first(rows):
    assert select(rows, split="train", limit=2) == select(rows, split="train")[:2]
    assert select(rows, limit=999) == rows


def test_a_draw_is_stable_and_grows(rows):
    three, five = select(rows, sample=3), select(rows, sample=5)
    assert five[:3] == three
    assert len(set(ids(five))) == 5
    assert select(rows[::-1], sample=5) == five
    assert ids(select(rows, sample=999)) != ids(rows)
    without = [row for row in rows if row not in three]
    assert select(without, sample=2) == five[3:]
    assert select(rows, sample=5, limit=3) == three


@pytest.mark.parametrize(
    ("unknown", "message"),
    [
        (["p0000", "p0009"], r"not in the manifest: 'p0009' \(nearest: p000\d\)$"),
        (["p0000-c0-n0"], r"'p0000-c0-n0' \(nearest: p0000-c0-n00\)"),
        (["quark"], "not in the manifest: 'quark'$"),
        (["p9", "p8", "p7", "p6", "p5", "p9"], " and 2 more$"),
    ],
)
def test_unknown_ids_are_named_with_their_nearest(unknown, message, rows):
    with pytest.raises(SelectionError, match=message):
        select(rows, unknown)


def test_unknown_split_lists_the_splits(rows):
    with pytest.raises(
        SelectionError, match="split 'tes': there are modification_validation, test, tr"
    ):
        select(rows, split="tes")


@pytest.mark.parametrize("name", ["sample", "limit"])
def test_a_number_that_is_not_positive_is_refused(name, rows):
    with pytest.raises(SelectionError, match=f"{name} = 0, must be at least 1"):
        select(rows, **{name: 0})


@pytest.fixture(scope="module")
def corpus_rows():
    """Every tenth row of the corpus, all kinds among them."""
    return read_manifest(recorded_manifest("full"))[::10]


@pytest.mark.parametrize(
    "where",
    ["split = 'tset'", "'Sand' in materials", "kind = 'seeds'", "edit = 'swap'"],
)
def test_where_no_row_is_found_the_values_are_named(where, corpus_rows):
    with pytest.raises(SelectionError) as error:
        select(corpus_rows, where=where)
    assert f"satisfies {where!r}" in str(error.value)
    for values in (
        "kind: child, parent, perturbation",
        "split: modification_validation, test, train",
        "edit: add_object, change_contact,",
        "materials: elastic, elastic_fem, liquid,",
        "object_types: dynamic_body, emitter,",
    ):
        assert values in str(error.value)


def test_rows_are_found_by_their_edit_and_by_names_of_seeds(corpus_rows):
    where = "edit = 'swap_material' and 's06_slow_press' in seeds"
    found = select(corpus_rows, where=where)
    assert found
    for row in found:
        assert '"operator": "swap_material"' in row.edit
        assert "s06_slow_press" in row.seeds
