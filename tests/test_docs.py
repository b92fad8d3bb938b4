"""What the documentation tells to do works, on a copy of the repository."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fenced import FENCE
from tests.test_layout import not_copied

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
RUN = [page for page in PAGES if FENCE.search(page.read_text("utf-8"))]
LINK = re.compile(r"\]\((?!https?:)([^)#]+)")
MOST_LINES = 150


@pytest.fixture
def checkout(small, tmp_path):
    """A copy of the repository that holds a release."""
    copy = tmp_path / "checkout"
    shutil.copytree(ROOT, copy, symlinks=True, ignore=not_copied)
    shutil.copytree(small.release, copy / "release/mpmworlds")
    return copy


def run(page, folder):
    """Run a page where `mpmworlds` is the one of a folder."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    environment |= {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(folder / "src"),
    }
    return subprocess.run(
        [sys.executable, "-m", "tests.fenced", page],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=600,
    )


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=lambda page: page.stem)
def test_page_does_what_it_says(page, checkout):
    done = run(page, checkout)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("block", "told"),
    [
        ("```python\nassert 1 > 2\n```\n", 'page.md", line 4'),
        ("```bash\nfalse\ntrue\n```\n", "CalledProcessError"),
        ("```diff\n--- a/x\n+++ b/x\n@@ -1 +1 @@\n-a\n+b\n```\n", "x: No such file"),
        ("```text\nfalse\n```\n", ""),
        ("```python made.py\nx = 1\n```\n\n```python\nimport made\n```\n", ""),
    ],
    ids=["python", "bash", "diff", "text", "file"],
)
def test_block_that_fails_fails_its_page(block, told, tmp_path):
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    page = tmp_path / "page.md"
    page.write_text(f"# Page\n\n{block}")
    done = run(page, tmp_path)
    assert (done.returncode != 0) == bool(told), done.stdout
    assert told in done.stdout


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    for target in LINK.findall(page.read_text("utf-8")):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_is_short_and_in_the_index(page):
    assert len(page.read_text("utf-8").splitlines()) <= MOST_LINES
    index = (ROOT / "docs/README.md").read_text("utf-8")
    assert page.name == "README.md" or f"]({page.name})" in index
