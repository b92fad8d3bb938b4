"""The bits of a run are those of its program, whenever, beside whatever, on what CPU.

`docs/bits.md` says what is promised.
"""

import shlex
import shutil
import sys
from functools import cache

import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__

from mpmworlds.builder.render.executors import carry_out_all, open_executor
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.run.run import run
from tests.sim.bits import VARIED, bits_of, small_program

FRAMES = 24
LEVELS = {  # of the instructions that NumPy chooses by the CPU: which it then lacks
    "AVX2": [name for name in __cpu_dispatch__ if "512" in name or "V4" in name],
    "SSE": __cpu_dispatch__,
}
HAS_FMA = {"IvyBridge": False, "Haswell": True}  # both have AVX, neither AVX-512
TELLS_FEATURES = """\
from numpy._core._multiarray_umath import __cpu_features__

raise ValueError([name for name, there in __cpu_features__.items() if there])
"""


@cache
def program_of(name):
    return small_program(name, FRAMES)


@cache
def native(name):
    return bits_of(program_of(name))


@pytest.fixture
def limit_numpy(tmp_path, monkeypatch):
    """Return a function: a level of `LEVELS`, and what else starts Python."""

    def start(level, *starter):
        python, lacks = tmp_path / "python", " ".join(LEVELS[level])
        command = ["env", f"NPY_DISABLE_CPU_FEATURES={lacks}", *starter, sys.executable]
        python.write_text(f'#!/bin/sh\nexec {shlex.join(command)} "$@"\n')
        python.chmod(0o755)
        monkeypatch.setattr(sys, "executable", str(python))

    return start


@pytest.fixture
def become(limit_numpy):
    """Return a function: the name of a CPU, on which programs run from then on."""
    if shutil.which("qemu-x86_64") is None:
        pytest.skip("qemu-x86_64 is not installed (Debian: qemu-user)")
    # QEMU 7.2 runs the AVX2 code of `np.argsort` wrong: its results are not in order.
    return lambda cpu: limit_numpy("SSE", "qemu-x86_64", "-cpu", cpu)


def test_the_varied_seeds_have_the_materials_of_all_seeds():
    seeds = load_seeds()
    reached = set().union(*(seeds[name].materials for name in VARIED))
    assert reached == set().union(*(seed.materials for seed in seeds.values()))


@pytest.mark.long
@pytest.mark.parametrize("name", VARIED)
def test_a_second_run_gives_the_same_bits(name):
    assert bits_of(program_of(name)) == native(name)


@pytest.mark.long
@pytest.mark.parametrize("workers", [1, 2])
def test_any_number_of_workers_gives_the_same_bits(workers):
    names = {program_of(name): name for name in VARIED}
    with open_executor(bits_of, workers) as executor:
        found = dict(carry_out_all(executor, names, names.__getitem__))
    assert found == {program: native(name) for program, name in names.items()}


@pytest.mark.long
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("name", VARIED)
def test_less_able_numpy_gives_the_same_bits(name, level, limit_numpy):
    expected = native(name)
    limit_numpy(level)
    assert bits_of(program_of(name)) == expected


@pytest.mark.parametrize("cpu", HAS_FMA)
def test_an_emulated_cpu_has_its_own_instructions_only(cpu, become):
    become(cpu)
    message = run(TELLS_FEATURES, trusted=True).message
    assert "'AVX'" in message
    assert ("'FMA3'" in message) == HAS_FMA[cpu]
    assert "'AVX512F'" not in message


@pytest.mark.long
@pytest.mark.parametrize("cpu", HAS_FMA)
@pytest.mark.parametrize("name", VARIED)
def test_another_cpu_gives_the_same_bits(name, cpu, become):
    expected = native(name)
    become(cpu)
    assert bits_of(program_of(name)) == expected
