"""The repository's top-level folders are the package, in every way of installing it."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "mpmworlds"
FOLDERS = ("baselines", "builder", "loaders", "metrics", "sim", "splits")
LINKS = (*FOLDERS, "dataset_card.md")
NOT_COPIED = shutil.ignore_patterns(
    ".git", ".venv", ".dvc", ".*_cache", "__pycache__", "*.egg-info"
)
GENERATED = {"release", "work"}  # at the top


def not_copied(folder, names):
    """What `shutil.copytree` leaves out of a copy of the repository."""
    generated = GENERATED & set(names) if Path(folder) == ROOT else set()
    return NOT_COPIED(folder, names) | generated


@pytest.mark.parametrize("name", LINKS)
def test_link_is_relative_and_leads_to_the_top_level(name):
    link = PACKAGE / name
    assert link.is_symlink(), (
        f"src/mpmworlds/{name} is no link: was the repository cloned with "
        "core.symlinks=false?"
    )
    assert os.readlink(link) == f"../../{name}"
    assert link.exists()


def test_source_folder_holds_only_links_and_the_root_modules():
    real = {path.name for path in PACKAGE.iterdir() if not path.is_symlink()}
    assert real - {"__pycache__"} <= {
        "__init__.py",
        "__main__.py",
        "cli",
        "files",
        "py.typed",
    }


@pytest.mark.parametrize("name", ["mpmworlds", "mpmworlds.py"])
def test_nothing_at_the_root_shadows_the_dataset_name(name):
    assert not (ROOT / name).exists()


def package_files():
    """Return the files that an installation must hold, relative to the package."""
    sources = {
        path.relative_to(ROOT).as_posix()
        for folder in FOLDERS
        for pattern in (
            "*.py",
            "seeds/*.yaml",
            "launch/*.yaml",
            "recipes/*.yaml",
            "wording/*.yaml",
            "report/paper.yaml",
            "report/page/*",
            "search/prior.yaml",
            "gallery/page/*",
            "recorded/*.parquet",
            "recorded/*/*",
        )
        for path in (ROOT / folder).rglob(pattern)
    }
    return (
        sources
        | {path.name for path in PACKAGE.glob("*.py")}
        | {
            path.relative_to(PACKAGE).as_posix()
            for room in ("cli", "files")
            for path in (PACKAGE / room).glob("*.py")
        }
        | {
            "py.typed",
            "dataset_card.md",
            "params.yaml",
        }
    )


@pytest.fixture(scope="module")
def distributions(tmp_path_factory):
    """Build the wheel and the source distribution from a copy of the tree."""
    copy = tmp_path_factory.mktemp("tree") / "copy"
    shutil.copytree(ROOT, copy, symlinks=True, ignore=not_copied)
    out = tmp_path_factory.mktemp("dist")
    hooks = (
        "import sys; from setuptools import build_meta as b; "
        "out = sys.argv[1]; b.build_sdist(out); b.build_wheel(out)"
    )
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", hooks, out],
        cwd=copy,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    (wheel,) = out.glob("*.whl")
    (sdist,) = out.glob("*.tar.gz")
    return wheel, sdist


def test_wheel_holds_every_module_and_the_data(distributions):
    with zipfile.ZipFile(distributions[0]) as archive:
        names = set(archive.namelist())
    assert {f"mpmworlds/{name}" for name in package_files()} <= names
    assert not [name for name in names if name.startswith(("tests/", "src/"))]


def test_sdist_holds_files_in_place_of_links(distributions):
    with tarfile.open(distributions[1]) as archive:
        members = {
            member.name.partition("/")[2]: member for member in archive.getmembers()
        }
    expected = {f"src/mpmworlds/{name}" for name in package_files()}
    assert expected <= members.keys()
    assert all(members[name].isfile() for name in expected)


def test_sdist_holds_tests_and_recipe(distributions):
    with tarfile.open(distributions[1]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    tests = {p.relative_to(ROOT).as_posix() for p in (ROOT / "tests").rglob("*.py")}
    recipe = {"dvc.yaml", "params.yaml", "LICENSE", "LICENSE-DATA", ".ci/run"}
    assert tests | recipe <= names


def test_wheel_installs_and_imports_without_the_checkout(distributions, tmp_path):
    with zipfile.ZipFile(distributions[0]) as archive:
        archive.extractall(tmp_path)
    probe = "import mpmworlds.splits, mpmworlds as m; print(m.__file__)"
    done = subprocess.run(
        [sys.executable, "-c", probe],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert Path(done.stdout.strip()).is_relative_to(tmp_path)
