"""A program is its scene, the skeleton, and the library's own functions: no more."""

import ast
import json
import os
import re
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib.resources import files

import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim import link as linker
from mpmworlds.sim.link import LinkError, link, read_scene, unresolved
from mpmworlds.sim.scene.scene import Scene
from tests.sim.pin_programs import PINNED, checksums
from tests.sim.scenes import (
    BELT,
    BODY,
    BOWL,
    EGG,
    FAN,
    GATE,
    HOSE,
    JET,
    MANY,
    MESH,
    OBSTACLE,
    PASTE,
    PLASTIC,
    RAIN,
    RIGID,
    ROCKER,
    SAND,
    SLIME,
    SNOW,
    WET_SAND,
    random_scene,
    scene_data,
)

SIM = files("mpmworlds.sim")
LIBRARY = {
    path.name: path.read_text("ascii")
    for path in SIM.joinpath("physics").iterdir()
    if path.name.endswith(".py")
}
SKELETON = SIM.joinpath("skeleton.py").read_text("ascii")
IMPORT = re.compile(r"\s*(import|from) ").match
SPECIAL = {
    "jet": [JET],
    "body": [BODY],
    "snow": [BODY | {"physics_properties": SNOW}],
    "sand jet": [JET | {"physics_properties": SAND}],
    "rigid alone": [BODY | {"physics_properties": RIGID}],
    "rigid in a jet": [BODY | {"physics_properties": RIGID}, JET],
    "mesh": [BODY | {"physics_properties": MESH}],
    "plastic": [BODY | {"physics_properties": PLASTIC}],
    "wet sand": [BODY | {"physics_properties": WET_SAND}],
    "wet sand in a jet": [BODY | {"physics_properties": WET_SAND}, JET],
    "paste": [JET | {"physics_properties": PASTE}],
    "slime": [BODY | {"physics_properties": SLIME}],
    "fan": [BODY, FAN],
    "gate": [BODY, GATE],
    "fan and gate": [BODY, FAN, GATE | {"name": "gate"}],
    "all": [BODY, OBSTACLE, FAN, JET],
    "egg and bowl": [EGG, BOWL],
    "belt": [EGG, BELT],
    "rocker": [EGG, ROCKER],
    "rain": [RAIN, BOWL],
    "hose": [HOSE],
    "everything": [EGG, BOWL, BELT, ROCKER, RAIN, HOSE],
}


@dataclass(frozen=True)
class Program:
    """A linked scene, parsed once for all tests."""

    scene: Scene
    text: str
    body: list[ast.stmt]

    @classmethod
    def of(cls, scene):
        text = link(scene)
        return cls(scene, text, ast.parse(text).body)


def functions_of(body):
    """Functions among statements by their names."""
    return {node.name: node for node in body if isinstance(node, ast.FunctionDef)}


def first_line(node):
    """Number of the line on which a function starts, decorators included."""
    return min([node.lineno, *(d.lineno for d in node.decorator_list)])


def sources_of(text):
    """Text of every function at the top level, decorators included."""
    lines = text.splitlines()
    return {
        name: "\n".join(lines[first_line(node) - 1 : node.end_lineno])
        for name, node in functions_of(ast.parse(text).body).items()
    }


LIBRARY_SOURCES = {
    k: v for text in LIBRARY.values() for k, v in sources_of(text).items()
}


@pytest.fixture(scope="module")
def programs():
    """Programs of many random scenes and of some with few features."""
    chosen = {str(i): random_scene(i) for i in range(MANY)}
    chosen |= {k: Scene.from_data(scene_data(*v)) for k, v in SPECIAL.items()}
    return {name: Program.of(scene) for name, scene in chosen.items()}


@pytest.fixture(scope="module")
def texts():
    """Checksums of the programs of the seeds."""
    return checksums()


@pytest.fixture(scope="module")
def folder(programs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("programs")
    for name, program in programs.items():
        path = folder.joinpath(f"{name.replace(' ', '_')}.py")
        path.write_text(program.text, "ascii")
    return folder


def test_random_scenes_have_many_forms(programs):
    scenes = [program.scene for program in programs.values()]
    assert len({scene.to_yaml() for scene in scenes}) > 40
    assert len({frozenset(linker.features(scene)) for scene in scenes}) > 6


def test_reading_the_scene_back_gives_the_scene(programs):
    assert all(read_scene(p.text) == p.scene for p in programs.values())


def test_library_functions_stand_in_programs_verbatim(programs):
    seen = set()
    for program in programs.values():
        for name in LIBRARY_SOURCES.keys() & functions_of(program.body).keys():
            assert f"\n\n{LIBRARY_SOURCES[name]}\n\n" in program.text
            seen.add(name)
    assert seen == LIBRARY_SOURCES.keys()


def test_programs_have_no_dead_function(programs):
    for name, program in programs.items():
        functions = functions_of(program.body)
        waiting = [n for n in program.body if not isinstance(n, ast.FunctionDef)]
        reached = set()
        while waiting:
            used = {n.id for n in ast.walk(waiting.pop()) if isinstance(n, ast.Name)}
            found = used & functions.keys() - reached
            reached |= found
            waiting += [functions[f] for f in found]
        assert reached == functions.keys(), name


def test_programs_define_nothing_twice(programs):
    for program in programs.values():
        names = [node.name for node in program.body if hasattr(node, "name")]
        assert len(set(names)) == len(names)


def test_programs_import_the_standard_library_and_three_packages(programs):
    for program in programs.values():
        lines = [line.split()[1] for line in program.text.splitlines() if IMPORT(line)]
        assert lines == ["sys", "cv2", "numpy", "taichi", "taichi.math"]


def test_programs_keep_no_mark_of_the_skeleton(programs):
    for program in programs.values():
        assert "region" not in program.text
        assert "mpmworlds" not in program.text


def test_programs_compile_and_are_ascii(programs):
    for name, program in programs.items():
        compile(program.text, name, "exec")
        assert program.text.isascii()


def test_programs_are_formatted(folder):
    command = [sys.executable, "-m", "ruff", "format", "--check", "--isolated", folder]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout


def test_programs_have_no_unresolved_or_unused_name_and_no_long_line(folder):
    command = [sys.executable, "-m", "ruff", "check", "--isolated", folder]
    command += ["--select", "F,E501", "--output-format", "concise"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout


def test_linking_does_not_depend_on_the_order_of_hashing(texts):
    program = (
        "from tests.sim.pin_programs import checksums; import json;"
        "print(json.dumps(checksums()))"
    )
    root = str(PINNED.parents[2])
    for seed in ("1", "2"):
        found = subprocess.run(
            [sys.executable, "-c", program],
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": root},
            capture_output=True,
            check=True,
        )
        assert json.loads(found.stdout) == texts


@pytest.mark.parametrize("seed", load_seeds())
def test_the_program_of_a_seed_is_the_recorded_one(texts, seed):
    assert texts[seed] == json.loads(PINNED.read_text("utf-8")).get(seed), (
        f"the program of {seed} is not the recorded one: changed output needs a "
        "version bump (pyproject.toml, CHANGELOG.md); to record the new ones, run "
        "python -m tests.sim.pin_programs"
    )


def test_linking_is_fast():
    seeds = load_seeds().values()
    seconds = []
    for scene in [*seeds, *seeds]:
        start = time.process_time()
        link(scene)
        seconds.append(time.process_time() - start)
    assert statistics.median(seconds[len(seeds) :]) < 0.05


def test_the_scene_of_the_skeleton_links_to_the_skeleton():
    linked = link(read_scene(SKELETON))
    code, expected = ast.parse(linked).body, ast.parse(SKELETON).body
    constants = {"SIMULATION", "ENVIRONMENT", "OBJECTS", "OUTPUT", "KINDS"}

    def belongs(node):
        """Whether a statement is the same in both: no import, constant or library."""
        own = getattr(node, "name", None) not in LIBRARY_SOURCES
        target = getattr(node, "targets", [None])[0]
        return own and not (
            isinstance(node, ast.Import | ast.ImportFrom)
            or (isinstance(target, ast.Name) and target.id in constants)
        )

    assert [ast.unparse(node) for node in code if belongs(node)] == [
        ast.unparse(node) for node in expected if belongs(node)
    ]


def test_a_name_that_nothing_defines_is_an_error(monkeypatch):
    def careless(scene):
        return "def stress(p, m):\n    return vanish(p) + ti.sin(m)\n"

    monkeypatch.setitem(linker.REGIONS, "materials", careless)
    with pytest.raises(LinkError, match="undefined names: vanish"):
        link(Scene.from_data(scene_data()))


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("a = 1\ndef f(b):\n    c = 2\n    return a + b + c + len('x')\n", []),
        ("def f():\n    return g()\n", ["g"]),
        ("def f():\n    return [h(i) for i in range(3)]\n", ["h"]),
        ("import os.path as p\nprint(p, os)\n", ["os"]),
        ("x.y = 1\n", ["x"]),
    ],
)
def test_unresolved_names_are_those_that_are_read_but_never_bound(text, names):
    assert unresolved(text) == names


@pytest.mark.parametrize("name", LIBRARY)
def test_library_files_hold_functions_of_taichi_or_of_numpy_only(name):
    module, *rest = ast.parse(LIBRARY[name]).body
    assert isinstance(module, ast.Expr)
    numpy = "import numpy as np" in LIBRARY[name]
    for node in rest:
        if isinstance(node, ast.ImportFrom):
            assert node.module == "taichi.math" or node.module.startswith(
                "mpmworlds.sim.physics."
            )
        elif isinstance(node, ast.Import):
            assert ast.unparse(node) in ("import taichi as ti", "import numpy as np")
        else:
            assert isinstance(node, ast.FunctionDef)
            decorators = [ast.unparse(d) for d in node.decorator_list]
            assert decorators == ([] if numpy else ["ti.func"])
            assert ast.get_docstring(node)


def test_library_functions_have_names_of_their_own():
    count = sum(text.count("\ndef ") for text in LIBRARY.values())
    assert len(LIBRARY_SOURCES) == count


def test_no_local_name_hides_a_library_function():
    for text in (*LIBRARY.values(), SKELETON):
        for function in functions_of(ast.parse(text).body).values():
            taken = {arg.arg for arg in function.args.args} | {
                node.id
                for node in ast.walk(function)
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
            }
            assert not taken & LIBRARY_SOURCES.keys(), function.name


def test_library_functions_read_nothing_but_arguments_and_each_other():
    math = {"np", "ti", "vec2", "vec3", "vec4", "ivec2", "cmul", "cconj"}
    for name, source in LIBRARY_SOURCES.items():
        assert set(unresolved(source)) <= LIBRARY_SOURCES.keys() | math, name
