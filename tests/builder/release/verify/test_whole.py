"""Nothing is found where nothing is wrong."""

from mpmworlds.builder.release.verify import verify_release
from tests.builder.release.verify.damage import (
    SAMPLES,
    TEST,
    findings_of,
    fix_up,
    rewrite,
)


def test_a_release_as_it_was_built_has_no_findings(simulated):
    verified = verify_release(simulated, resimulate=3)
    assert verified.findings == ()
    assert sorted(s.id for s in verified.simulated) == sorted(SAMPLES)
    assert {s.tier for s in verified.simulated} == {"exact"}


def test_a_release_that_was_fixed_up_has_no_findings(copy):
    before = (copy / "SHA256SUMS").read_bytes()
    fix_up(copy)
    assert (copy / "SHA256SUMS").read_bytes() == before
    rewrite(copy, TEST, lambda rows: rows)
    assert findings_of(copy) == []
