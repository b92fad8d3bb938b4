"""A served model, really: llama.cpp and SmolLM2-135M-Instruct on the loopback.

It sees no pictures, and what it writes is no simulation; each candidate ends in a typed
outcome, and nothing breaks.
"""

import pytest

from mpmworlds.baselines.results import read_results
from mpmworlds.baselines.served.usage import usage_of
from mpmworlds.sim.run.receive import STATUSES
from tests.builder.llm.test_real_server import address  # noqa: F401 - a fixture

pytestmark = pytest.mark.long
OF_REPLIES = {"truncated", "no_program", "refused", "empty"}
OF_PROGRAMS = STATUSES | {"passed_over", "wrong_shape"}


def test_whatever_a_small_model_writes_ends_in_a_typed_outcome(
    address,  # noqa: F811
    command,
    release,
    tmp_path,
    monkeypatch,
):
    monkeypatch.setenv("OPENAI_BASE_URL", address)
    monkeypatch.setenv("OPENAI_API_KEY", "x")
    options = ["model=smollm2", "n=2", "pictures=0", "max_tokens=300", "timeout=1800"]
    options.append(f"transcripts={tmp_path / 'transcripts'}")
    arguments = [
        *("evaluate", "--predictor", "served", "--release", release),
        *("--limit", 1, "--workers", 1, "--out", tmp_path / "out"),
        *(part for one in options for part in ("--predictor-option", one)),
    ]
    status, _, err = command(*arguments)
    assert status == 0, err
    _, results = read_results(tmp_path / "out" / "results.jsonl")
    assert len(results) == 2
    assert {result.outcome for result in results} <= OF_REPLIES | OF_PROGRAMS
    usage = usage_of(tmp_path / "transcripts")
    assert sum(usage.endings.values()) == usage.requests == 2
    assert usage.endings.keys() <= {"stop", "length"}
    assert 500 < usage.prompt_tokens / 2 < 3000
