"""Expressions mean what they say and can do nothing else."""

from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest
from mpmworlds.builder.plan.select import SelectionError, parse, select


@pytest.fixture(scope="module")
def row(make_row):
    return replace(
        make_row("p0123-c4", "train", ""),
        materials=("liquid", "sand"),
        object_types=("dynamic_body", "emitter"),
        seeds=("s01", "s07"),
        num_objects=3,
        num_materials=2,
    )


@pytest.mark.parametrize(
    ("expression", "answer"),
    [
        ("material == 'sand'", True),
        ("material == 'snow'", False),
        ("material != 'sand'", False),
        ("material != 'snow'", True),
        ("'sand' == material", True),
        ("'sand' in material", True),
        ("'sand' not in material", False),
        ("material in ['snow', 'sand']", True),
        ("material in ['snow', 'rigid']", False),
        ("material not in ('snow', 'rigid')", True),
        ("object_type == 'emitter'", True),
        ("seed in ['s07']", True),
        ("num_objects >= 3", True),
        ("num_objects > 3", False),
        ("num_objects <= 2.5", False),
        ("num_objects < 4", True),
        ("num_objects != 3", False),
        ("num_objects == 3.0", True),
        ("num_objects > -1", True),
        ("num_objects in [1, 3]", True),
        ("num_objects not in [1, 3]", False),
        ("2 <= num_objects < 3", False),
        ("2 <= num_objects < 4", True),
        ("num_materials < num_objects", True),
        ("split == 'train'", True),
        ("kind in ['child', 'parent']", True),
        ("id == 'p0123-c4'", True),
        ("id >= 'p0100'", True),
        ("family_id != 'p0123'", False),
        ("parent_id == 'p0123'", True),
        ("not material == 'sand'", False),
        ("material == 'sand' and num_objects > 3", False),
        ("material == 'sand' or num_objects > 3", True),
        ("material == 'snow' and num_objects > 9 or kind == 'child'", True),
        ("material == 'snow' and (num_objects > 9 or kind == 'child')", False),
        ("  material == 'sand'\n", True),
    ],
)
def test_expression_holds(expression, answer, row):
    assert parse(expression)(row) is answer


@pytest.mark.parametrize(
    ("expression", "column", "reason"),
    [
        ("", 1, "invalid syntax"),
        ("material = 'sand'", 10, "invalid syntax"),
        ("material == 'sand", 13, "unterminated string"),
        ("split == 'train' and materials == 'sand'", 22, "materials, perhaps material"),
        ("kind == child", 9, "no column child; text stands in quotes"),
        ("num_objects == '3'", 1, "num_objects is a number, '3' a text"),
        ("material < 'sand'", 1, "material is a set, 'sand' a text"),
        ("material == 3", 1, "cannot be compared"),
        ("num_objects in 3", 1, "cannot be compared"),
        ("id in 'p0123'", 1, "cannot be compared"),
        ("id in [3]", 1, "'?id is a text, .* a list of numbers"),
        ("id in ['p0123', 3]", 7, "texts or numbers, not both"),
        ("id in []", 7, "no text, number or column"),
        ("id is 'p0123'", 1, "cannot be compared"),
        ("material", 1, "no comparison"),
        ("num_objects + 1 > 3", 1, "no text, number or column"),
        ("num_objects > True", 15, "no text, number or column"),
        ("num_objects > -True", 15, "no text, number or column"),
        ("id == b'p'", 7, "no text, number or column"),
        ("id == f'{id}'", 7, "no text, number or column"),
        ("id == id.upper()", 7, "no text, number or column"),
        ("__import__('os').abort()", 1, "no comparison"),
        ("(lambda: 1)() == 1", 1, "no text, number or column"),
        ("[x for x in id] == 1", 1, "no text, number or column"),
        ("id == 'p\0'", 1, "cannot be read|null"),
        ("not " * 9999 + "id == 'p'", 1, "cannot be read|too many|overflow"),
    ],
)
def test_anything_else_is_refused_where_it_stands(expression, column, reason):
    message = rf"column {column}: .*({reason}).*; allowed are the sets material,"
    with pytest.raises(SelectionError, match=message) as error:
        parse(expression)
    assert repr(expression.strip()) in str(error.value)


@given(st.text(max_size=40))
def test_any_text_is_an_expression_or_a_selection_error(text):
    with suppress(SelectionError):
        parse(text)


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
    ("where", "message"),
    [
        ("split != 'tset'", "no row has split 'tset'; perhaps 'test'; there are"),
        ("'Sand' == material", "no row has material 'Sand'; perhaps 'sand'; there are"),
        ("kind in ['parent', 'seeds']", "no row has kind 'seeds'; perhaps 'seed'"),
        ("not (num_objects > 1 and seed == 's6')", "no row has seed 's6'"),
        ("edit == 'swap'", "no row has edit 'swap'"),
    ],
)
def test_a_value_that_no_row_has_is_refused(where, message, corpus_rows):
    with pytest.raises(SelectionError) as error:
        select(corpus_rows, where=where)
    assert message in str(error.value)


def test_rows_are_found_by_their_edit_and_by_short_names_of_seeds(corpus_rows):
    found = select(corpus_rows, where="edit == 'swap_material' and seed == 's06'")
    assert found
    for row in found:
        assert '"operator": "swap_material"' in row.edit
        assert "s06_slow_press" in row.seeds
