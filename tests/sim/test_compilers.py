"""A program gives the same bits under every compiler; an absent one is told."""

import sys
from functools import cache
from importlib.util import find_spec

import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.compilers import MODULES
from mpmworlds.sim.run.run import run
from tests.sim.bits import bits_of, small_program

FRAMES = 12
FORKS = [compiler for compiler in MODULES if compiler != "taichi"]
TELLS_ITS_COMPILER = """\
import taichi as ti
from taichi.math import vec2

raise ValueError(f"{ti.__name__} {ti.math.__name__} {vec2 is ti.math.vec2}")
"""


@pytest.fixture(params=FORKS)
def fork(request):
    """A compiler that is not Taichi and is installed."""
    # Looked for, not imported: two compilers in one process are not what is tested.
    if find_spec(MODULES[request.param]) is None:
        pytest.skip(f"{request.param} is not installed (the extra [compilers])")
    return request.param


@cache
def under_taichi(program):
    return bits_of(program, FRAMES)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["s12_pinwheel_block", "s19_five_materials"])
def test_some_seeds_have_the_same_bits(name, fork):
    program = small_program(name, FRAMES)
    assert bits_of(program, FRAMES, fork) == under_taichi(program)


@pytest.mark.long
@pytest.mark.parametrize("name", load_seeds())
def test_all_seeds_have_the_same_bits(name, fork):
    program = link(load_seeds()[name])
    assert bits_of(program, FRAMES, fork) == under_taichi(program)


def test_the_program_gets_the_compiler_that_was_asked_for(fork):
    module = MODULES[fork]
    message = run(TELLS_ITS_COMPILER, compiler=fork).message
    assert f"ValueError: {module} {module}.math True" in message


def test_by_default_it_is_taichi():
    message = run(TELLS_ITS_COMPILER).message
    assert "ValueError: taichi taichi.math True" in message


@pytest.mark.parametrize("compiler", FORKS)
def test_absent_compiler_says_what_to_install(compiler, command, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, MODULES[compiler], None)
    program = tmp_path / "program.py"
    program.write_text(TELLS_ITS_COMPILER)
    status, out, err = command("run", program, "--compiler", compiler)
    assert (status, out) == (2, "")
    assert f"the compiler {compiler} is not installed" in err
    assert "pip install 'mpmworlds[compilers]'" in err


def test_unknown_compiler_is_refused_with_those_that_are_known():
    with pytest.raises(ValueError, match=r"compiler = 'gcc', must be one of taichi, "):
        run(TELLS_ITS_COMPILER, compiler="gcc")
