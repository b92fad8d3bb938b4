"""The grammar of sample ids."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.splits import SampleId, SampleIdError
from mpmworlds.splits.ids import SAMPLE_KINDS

families = st.one_of(
    st.integers(0, 20_000).map(lambda number: f"p{number:04d}"),
    st.integers(0, 200).map(lambda number: f"s{number:02d}"),
)
optional_numbers = st.none() | st.integers(0, 300)
sample_ids = st.builds(SampleId, families, optional_numbers, optional_numbers)


@given(sample_ids)
def test_parsing_inverts_writing(sample):
    assert SampleId.parse(str(sample)) == sample


@given(st.text("psc-n0123456789", max_size=14))
def test_every_accepted_text_is_the_one_spelling(text):
    try:
        sample = SampleId.parse(text)
    except SampleIdError:
        return
    assert str(sample) == text


@pytest.mark.parametrize(
    ("text", "template", "family"),
    [
        ("p0123", "p0123", "p0123"),
        ("p0123-c4", "p0123-c4", "p0123"),
        ("p0123-c4-n07", "p0123-c4", "p0123"),
        ("p0123-n07", "p0123", "p0123"),
        ("s07-c12-n100", "s07-c12", "s07"),
    ],
)
def test_template_and_family_are_read_from_the_id(text, template, family):
    sample = SampleId.parse(text)
    assert (sample.template, sample.family) == (template, family)


@pytest.mark.parametrize(
    ("text", "kind", "made_from"),
    [
        ("s07", "seed", ""),
        ("p0123", "parent", ""),
        ("p0123-c4", "child", "p0123"),
        ("s07-c4", "child", "s07"),
        ("p0123-c4-n07", "perturbation", "p0123-c4"),
        ("p0123-n07", "perturbation", "p0123"),
    ],
)
def test_kind_and_origin_are_read_from_the_id(text, kind, made_from):
    sample = SampleId.parse(text)
    assert (sample.kind, sample.made_from) == (kind, made_from)
    assert kind in SAMPLE_KINDS


@pytest.mark.parametrize(
    "text",
    [
        "",
        "p12",
        "p00012",
        "x0123",
        "p0123-c04",
        "p0123-n7",
        "p0123-n07-c4",
        "p0123 ",
        "p0123-c4-n007",
        "P0123",
        "s7",
        "p\u0660123",
        "p0123\n",
    ],
)
def test_other_text_is_an_error_that_names_it(text):
    with pytest.raises(SampleIdError, match="sample id") as caught:
        SampleId.parse(text)
    assert repr(text) in str(caught.value)
