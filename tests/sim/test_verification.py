"""Whole programs agree with theory, experiment and conservation laws.

The cases are those of `benchmarks.physics`, which says what each is held against; here
they run on few cells. `python -m benchmarks.physics --coarse` prints what they find.
"""

import pytest
from benchmarks.physics import CASES


def marks(case):
    if case.slow:
        yield pytest.mark.slow


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=[*marks(case)]) for case in CASES.values()],
    ids=CASES,
)
def test_simulation_agrees_with_its_reference(case):
    failed = [check for check in case.solve(case.coarse).checks if not check.ok]
    assert not failed, "\n".join(map(str, failed))
