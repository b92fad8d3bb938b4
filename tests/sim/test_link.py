"""A program is its scene, the skeleton, and the library's own functions: no more."""

import ast
import json
import os
import statistics
import subprocess
import sys
import time
from importlib.resources import files

import pytest
from tests.sim.pin_programs import PINNED, checksums
from tests.sim.scenes import (
    BODY,
    FAN,
    GATE,
    JET,
    MANY,
    OBSTACLE,
    SAND,
    SNOW,
    random_scene,
    scene_data,
)

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim import link as linker
from mpmworlds.sim.link import LinkError, link, read_scene, unresolved
from mpmworlds.sim.scene import Scene

SIM = files("mpmworlds.sim")
LIBRARY = {
    path.name: path.read_text("ascii")
    for path in SIM.joinpath("physics").iterdir()
    if path.name.endswith(".py")
}
SKELETON = SIM.joinpath("skeleton.py").read_text("ascii")
SPECIAL = {
    "jet": [JET],
    "body": [BODY],
    "snow": [BODY | {"physics_properties": SNOW}],
    "sand jet": [JET | {"physics_properties": SAND}],
    "fan": [BODY, FAN],
    "gate": [BODY, GATE],
    "fan and gate": [BODY, FAN, GATE | {"name": "gate"}],
    "all": [BODY, OBSTACLE, FAN, JET],
}


def functions_of(text):
    """Functions at the top level of a text by their names."""
    tree = ast.parse(text)
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}


def names_in(node):
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


@pytest.fixture(scope="module")
def programs():
    """Programs of many random scenes and of some with few features, with the scene."""
    chosen = {str(i): random_scene(i) for i in range(MANY)}
    chosen |= {k: Scene.from_data(scene_data(*v)) for k, v in SPECIAL.items()}
    return {name: (scene, link(scene)) for name, scene in chosen.items()}


@pytest.fixture(scope="module")
def folder(programs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("programs")
    for name, (_, text) in programs.items():
        folder.joinpath(f"{name.replace(' ', '_')}.py").write_text(text, "ascii")
    return folder


def test_random_scenes_have_many_forms(programs):
    scenes = [scene for scene, _ in programs.values()]
    forms = {tuple(sorted(linker.features(scene))) for scene in scenes}
    assert len({scene.to_yaml() for scene in scenes}) > 50
    assert len(forms) > 6


def test_reading_the_scene_back_gives_the_scene(programs):
    assert all(read_scene(text) == scene for scene, text in programs.values())


def test_library_functions_stand_in_programs_verbatim(programs):
    library = {name for text in LIBRARY.values() for name in functions_of(text)}
    for _, text in programs.values():
        for name in library & functions_of(text).keys():
            source = ast.get_source_segment(text, functions_of(text)[name])
            assert any(f"@ti.func\n{source}\n" in entry for entry in LIBRARY.values())


def test_programs_have_no_dead_function(programs):
    for name, (_, text) in programs.items():
        functions = functions_of(text)
        waiting = [
            node
            for node in ast.parse(text).body
            if not isinstance(node, ast.FunctionDef)
        ]
        reached = set()
        while waiting:
            found = names_in(waiting.pop()) & functions.keys() - reached
            reached |= found
            waiting += [functions[f] for f in found]
        assert reached == functions.keys(), name


def test_programs_define_nothing_twice(programs):
    for _, text in programs.values():
        names = [
            node.name
            for node in ast.parse(text).body
            if hasattr(node, "decorator_list")
        ]
        assert len(set(names)) == len(names)


def test_programs_import_the_standard_library_and_three_packages(programs):
    for _, text in programs.values():
        nodes = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Import)]
        froms = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.ImportFrom)]
        found = {alias.name for node in nodes for alias in node.names}
        assert found == {"sys", "cv2", "numpy", "taichi"}
        assert [node.module for node in froms] == ["taichi.math"]


def test_programs_keep_no_mark_of_the_skeleton(programs):
    assert not any(
        word in text
        for _, text in programs.values()
        for word in ("region", "mpmworlds")
    )


def test_programs_compile_and_are_ascii(programs):
    for name, (_, text) in programs.items():
        compile(text, name, "exec")
        assert text.isascii()


def test_programs_are_formatted(folder):
    command = [sys.executable, "-m", "ruff", "format", "--check", "--isolated", folder]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout


def test_programs_have_no_unresolved_or_unused_name_and_no_long_line(folder):
    command = [sys.executable, "-m", "ruff", "check", "--isolated", folder]
    command += ["--select", "F,E501", "--output-format", "concise"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout


def test_linking_does_not_depend_on_the_order_of_hashing():
    program = (
        "from tests.sim.pin_programs import checksums; import json;"
        "print(json.dumps(checksums()))"
    )
    found = [
        subprocess.run(
            [sys.executable, "-c", program],
            env=os.environ
            | {"PYTHONHASHSEED": seed, "PYTHONPATH": str(PINNED.parents[2])},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]
    assert [json.loads(text) for text in found] == 2 * [checksums()]


@pytest.mark.parametrize("seed", load_seeds())
def test_the_program_of_a_seed_is_the_recorded_one(seed):
    assert checksums()[seed] == json.loads(PINNED.read_text("utf-8"))[seed], (
        f"the program of {seed} is not the recorded one: changed output needs a version "
        "bump (pyproject.toml, CHANGELOG.md); then run python -m tests.sim.pin_programs"
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
    library = {name for text in LIBRARY.values() for name in functions_of(text)}
    scene = {"SIMULATION", "ENVIRONMENT", "OBJECTS", "OUTPUT"}

    def belongs(node):
        """Whether a statement is the skeleton's own: no import, scene or library."""
        own = getattr(node, "name", None) not in library
        target = getattr(node, "targets", [None])[0]
        return own and not (
            isinstance(node, ast.Import | ast.ImportFrom)
            or (isinstance(target, ast.Name) and target.id in scene)
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
def test_library_files_hold_functions_of_taichi_only(name):
    module, *rest = ast.parse(LIBRARY[name]).body
    assert isinstance(module, ast.Expr)
    for node in rest:
        if isinstance(node, ast.ImportFrom):
            assert node.module == "taichi.math" or node.module.startswith(
                "mpmworlds.sim.physics."
            )
        elif isinstance(node, ast.Import):
            assert ast.unparse(node) == "import taichi as ti"
        else:
            assert isinstance(node, ast.FunctionDef)
            assert [ast.unparse(d) for d in node.decorator_list] == ["ti.func"]
            assert ast.get_docstring(node)


def test_library_functions_have_names_of_their_own():
    names = [name for text in LIBRARY.values() for name in functions_of(text)]
    assert len(set(names)) == len(names) > 10


def test_no_local_name_hides_a_library_function():
    library = {name for text in LIBRARY.values() for name in functions_of(text)}
    for text in (*LIBRARY.values(), SKELETON):
        for function in functions_of(text).values():
            taken = {arg.arg for arg in function.args.args} | {
                node.id
                for node in ast.walk(function)
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
            }
            assert not taken & library, function.name


def test_library_functions_read_nothing_but_arguments_and_each_other():
    library = {name for text in LIBRARY.values() for name in functions_of(text)}
    math = {"ti", "vec2", "vec3", "vec4", "ivec2", "cmul", "cconj"}
    for text in LIBRARY.values():
        assert unresolved(text) == []
        for function in functions_of(text).values():
            source = ast.unparse(function)
            assert set(unresolved(source)) <= library | math, function.name
