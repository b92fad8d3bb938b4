"""The architecture as a test: who may import whom, read from the syntax trees."""

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "mpmworlds"
TOP_LEVEL = ("sim", "splits", "metrics", "builder", "loaders", "baselines")
FOLDERS = ("files", *TOP_LEVEL)
ALLOWED = {
    "files": {"files"},
    "sim": {"files", "sim"},
    "splits": {"files", "sim", "splits"},
    "metrics": {"files", "sim", "metrics"},
    "builder": {"files", "sim", "splits", "metrics", "builder"},
    "loaders": {"files", "sim", "splits", "metrics", "loaders"},
    "baselines": set(FOLDERS),
}
EXCEPTIONS = {
    ("loaders", "mpmworlds.builder.release.features"),
    ("loaders", "mpmworlds.builder.release.layout"),
}
RELATIVE = "mpmworlds.sim.run.sandbox"  # loaded as a package of another name, too
OPTIONAL = {
    "accelerate",
    "diffusers",
    "matplotlib",
    "openai",
    "peft",
    "ray",
    "safetensors",
    "tokenizers",
    "torch",
    "transformers",
}
MODELS = tuple(f"mpmworlds.baselines.{name}" for name in ("small", "vlm", "vdm"))


@dataclass(frozen=True)
class Import:
    """One imported module or name, e.g. `mpmworlds.sim.scene.scene.Scene`."""

    target: str
    line: int
    at_top: bool
    for_types: bool


def imports_of(source: str) -> Iterator[Import]:
    """Yield every import of a module.

    Those `at_top` run when it is imported; those `for_types` never run.
    """
    tree = ast.parse(source)
    inside, unexecuted = set(), set()
    for block in ast.walk(tree):
        if isinstance(block, ast.FunctionDef | ast.AsyncFunctionDef):
            inside |= {id(node) for node in ast.walk(block)}
        if isinstance(block, ast.If) and "TYPE_CHECKING" in ast.unparse(block.test):
            unexecuted |= {id(node) for part in block.body for node in ast.walk(part)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            start = "." * node.level + (node.module or "")
            targets = [f"{start}.{alias.name}" for alias in node.names]
        else:
            continue
        for target in targets:
            yield Import(
                target, node.lineno, id(node) not in inside, id(node) in unexecuted
            )


def package_sources() -> dict[str, str]:
    """Return the text of every module of the package by its dotted name."""
    sources = {}
    home = ROOT / "src" / PACKAGE
    top = [(home, p) for pattern in ("*.py", "files/*.py") for p in home.glob(pattern)]
    below = [
        (ROOT, path) for folder in TOP_LEVEL for path in (ROOT / folder).rglob("*.py")
    ]
    for base, path in sorted(top + below):
        parts = [PACKAGE, *path.relative_to(base).with_suffix("").parts]
        if parts[-1] == "__init__":
            parts.pop()
        sources[".".join(parts)] = path.read_text(encoding="utf-8")
    return sources


def folder_of(name: str) -> str | None:
    parts = name.split(".")
    inside = parts[0] == PACKAGE and len(parts) > 1 and parts[1] in FOLDERS
    return parts[1] if inside else None


def is_or_is_in(target: str, module: str) -> bool:
    return target == module or target.startswith(module + ".")


def direction_errors(sources: Mapping[str, str]) -> list[str]:
    """Return the imports that point to a layer to the right, or out of the layers."""
    errors = []
    for module, source in sources.items():
        layer = folder_of(module)
        if layer is None:
            continue
        for found in imports_of(source):
            target = found.target
            if target.startswith(".") and not is_or_is_in(module, RELATIVE):
                errors.append(f"{module}:{found.line} imports {target} relatively")
            if not is_or_is_in(target, PACKAGE) or target == f"{PACKAGE}.__version__":
                continue
            if folder_of(target) in ALLOWED[layer]:
                continue
            if any(
                layer == importer and is_or_is_in(target, exception)
                for importer, exception in EXCEPTIONS
            ):
                continue
            errors.append(f"{module}:{found.line} imports {target}")
    return errors


def may_import_taichi(module: str) -> bool:
    return module in [f"{PACKAGE}.sim.run.{name}" for name in ("readout", "shelf")]


def taichi_errors(sources: Mapping[str, str]) -> list[str]:
    """Return the imports of taichi outside what runs in a program's process."""
    return [
        f"{module}:{found.line} imports {found.target}"
        for module, source in sources.items()
        if not may_import_taichi(module)
        for found in imports_of(source)
        if is_or_is_in(found.target, "taichi")
    ]


def optional_errors(sources: Mapping[str, str]) -> list[str]:
    """Return the imports of optional packages that run when others are imported.

    A module of a learned model may import them at its top, if all others that import
    it do so within functions, or are such modules as well.
    """
    at_top = {
        module: [
            found
            for found in imports_of(source)
            if found.at_top and not found.for_types
        ]
        for module, source in sources.items()
    }
    heavy = {
        module: [one for one in found if one.target.split(".")[0] in OPTIONAL]
        for module, found in at_top.items()
    }
    optional = {
        module
        for module, found in heavy.items()
        if found and any(is_or_is_in(module, model) for model in MODELS)
    }
    grown = True
    while grown:  # what imports such a module at its top is one
        more = {
            module
            for module, found in at_top.items()
            if module not in optional
            and any(is_or_is_in(module, model) for model in MODELS)
            and not module.endswith(".predictor")  # which the registry imports
            and any(is_or_is_in(one.target, two) for one in found for two in optional)
        }
        optional |= more
        grown = bool(more)
    return [
        f"{module}:{one.line} imports {one.target}"
        for module, found in at_top.items()
        if module not in optional
        for one in found
        if one in heavy[module] or any(is_or_is_in(one.target, two) for two in optional)
    ]


def imported_modules(source: str, modules: Iterable[str]) -> set[str]:
    """Return which of `modules` a module runs by importing them or a name in them."""
    known = set(modules)
    found = set()
    for item in imports_of(source):
        if item.for_types:
            continue
        if item.target in known:
            found.add(item.target)
        elif item.target.rpartition(".")[0] in known:
            found.add(item.target.rpartition(".")[0])
    return found


def cycle_errors(sources: Mapping[str, str]) -> list[str]:
    """Return a cycle of imports between files, wherever in the files they stand.

    Imports for the type checker alone do not count.
    The root is left out: others take only `__version__` from it, which the rule of
    directions holds, and its own imports are deferred until they are used.
    """
    graph = {
        module: imported_modules(source, sources) - {module, PACKAGE}
        for module, source in sources.items()
        if module != PACKAGE
    }
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return [" <- ".join(error.args[1])]
    return []


CHECKS = {
    check.__name__: check
    for check in (direction_errors, taichi_errors, optional_errors, cycle_errors)
}


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS.keys())
def test_package_holds_rule(check):
    assert check(package_sources()) == []


def test_every_folder_is_read():
    read = {folder_of(module) for module in package_sources()}
    assert read >= set(FOLDERS)


@pytest.mark.parametrize(
    ("check", "sources"),
    [
        ("direction_errors", {"mpmworlds.sim.a": "import mpmworlds.builder.b"}),
        ("direction_errors", {"mpmworlds.sim.a": "from mpmworlds import metrics"}),
        ("direction_errors", {"mpmworlds.files.a": "import mpmworlds.sim.b"}),
        ("direction_errors", {"mpmworlds.splits": "from mpmworlds.metrics import x"}),
        (
            "direction_errors",
            {"mpmworlds.loaders.a": "import mpmworlds.builder.release.card"},
        ),
        (
            "direction_errors",
            {"mpmworlds.loaders.a": "from mpmworlds.builder import b"},
        ),
        ("direction_errors", {"mpmworlds.baselines.a": "import mpmworlds.cli"}),
        ("direction_errors", {"mpmworlds.metrics.a": "from mpmworlds import Scene"}),
        ("direction_errors", {"mpmworlds.metrics.a": "from .b import c"}),
        ("direction_errors", {"mpmworlds.sim.a": "def f():\n import mpmworlds.splits"}),
        ("taichi_errors", {"mpmworlds.sim.run.run": "def f():\n import taichi as ti"}),
        ("taichi_errors", {"mpmworlds.builder.a": "from taichi.lang import x"}),
        ("optional_errors", {"mpmworlds.loaders.t": "import torch.nn"}),
        (
            "optional_errors",
            {
                "mpmworlds.baselines.small.net": "import torch",
                "mpmworlds.baselines.registry": (
                    "from mpmworlds.baselines.small.net import x"
                ),
            },
        ),
        (
            "optional_errors",
            {
                "mpmworlds.baselines.vlm.net": "import torch",
                "mpmworlds.baselines.vlm.predictor": (
                    "from mpmworlds.baselines.vlm.net import x"
                ),
            },
        ),
        ("optional_errors", {"mpmworlds.cli": "try:\n from ray import x\nfinally: 0"}),
        (
            "cycle_errors",
            {
                "mpmworlds.sim.a": "import mpmworlds.sim.b",
                "mpmworlds.sim.b": "def f():\n from mpmworlds.sim.a import x",
            },
        ),
        (
            "cycle_errors",
            {
                "mpmworlds.sim.a": "if TYPE_CHECKING: 0\nelse: import mpmworlds.sim.b",
                "mpmworlds.sim.b": "import mpmworlds.sim.a",
            },
        ),
        (
            "cycle_errors",
            {
                "mpmworlds.sim": "from mpmworlds.sim.a import y",
                "mpmworlds.sim.a": "from mpmworlds.sim import x",
            },
        ),
    ],
)
def test_offending_module_is_found(check, sources):
    assert len(CHECKS[check](sources)) == 1


@pytest.mark.parametrize(
    ("check", "sources"),
    [
        ("direction_errors", {"mpmworlds.builder.a": "import mpmworlds.sim.b"}),
        ("direction_errors", {"mpmworlds.splits.a": "import mpmworlds.files.b"}),
        ("direction_errors", {"mpmworlds.sim.a": "from mpmworlds import __version__"}),
        (
            "direction_errors",
            {"mpmworlds.loaders.a": "from mpmworlds.builder.release.features import x"},
        ),
        ("direction_errors", {"mpmworlds.cli": "import mpmworlds.baselines.evaluate"}),
        ("taichi_errors", {"mpmworlds.sim.run.readout": "import taichi as ti"}),
        ("taichi_errors", {"mpmworlds.sim.run.shelf": "import taichi as ti"}),
        ("taichi_errors", {"mpmworlds.sim.program.a": "TEXT = 'import taichi as ti'"}),
        ("optional_errors", {"mpmworlds.loaders.t": "def f():\n import torch"}),
        (
            "optional_errors",
            {
                "mpmworlds.baselines.vlm.net": "import torch",
                "mpmworlds.baselines.vlm.training": (
                    "from mpmworlds.baselines.vlm.net import x"
                ),
                "mpmworlds.baselines.vlm.predictor": (
                    "def f():\n from mpmworlds.baselines.vlm.net import x"
                ),
            },
        ),
        (
            "cycle_errors",
            {
                "mpmworlds.sim.a": "if TYPE_CHECKING:\n import mpmworlds.sim.b",
                "mpmworlds.sim.b": "import mpmworlds.sim.a",
            },
        ),
        (
            "cycle_errors",
            {
                "mpmworlds.sim.a": "from mpmworlds.sim import b",
                "mpmworlds.sim.b": "import json",
                "mpmworlds.sim": "",
            },
        ),
    ],
)
def test_permitted_module_passes(check, sources):
    assert CHECKS[check](sources) == []


IMPORT_PROBE = """
import sys, time
start = time.perf_counter()
import {module}
seconds = time.perf_counter() - start
heavy = {{"taichi", "torch", "datasets", "cv2", "pyarrow"}} & set(sys.modules)
print(seconds, *sorted(heavy))
"""


def test_importing_the_package_is_light():
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_PROBE.format(module=PACKAGE)],
        capture_output=True,
        text=True,
        check=True,
    )
    seconds, *heavy = done.stdout.split()
    assert heavy == []
    assert float(seconds) < 0.5


def test_importing_the_loaders_takes_neither_taichi_nor_torch():
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_PROBE.format(module="mpmworlds.loaders")],
        capture_output=True,
        text=True,
        check=True,
    )
    assert not {"taichi", "torch"} & set(done.stdout.split()[1:])
