"""Draws from names."""

import hashlib

from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.splits.uniform import uniform


@given(st.text(max_size=8), st.text(max_size=8), st.text(max_size=8))
def test_draw_is_the_leading_53_bits_of_the_hash(salt, purpose, name):
    digest = hashlib.sha256(f"{salt}\0{purpose}\0{name}".encode()).hexdigest()
    bits = bin(int(digest, 16))[2:].zfill(256)[:53]
    assert uniform(salt, purpose, name) == (int(bits, 2) + 1) / 2**53


def test_draws_fill_the_unit_interval_evenly():
    draws = [uniform("salt", "purpose", str(number)) for number in range(10_000)]
    bins = [sum(k / 10 < value <= (k + 1) / 10 for value in draws) for k in range(10)]
    assert max(abs(count - 1000) for count in bins) < 4 * (1000 * 0.9) ** 0.5
