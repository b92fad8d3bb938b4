"""The script that continuous integration runs, on small repositories of its own."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = """# Title

<!-- test-command -->
```bash
git clone https://example.org/nobody/mpmworlds.git mpmworlds && cd mpmworlds && {tail}
```
"""


def git(folder, *arguments):
    identity = ["-c", "user.name=A", "-c", "user.email=a@example.org"]
    subprocess.run(["git", *identity, *arguments], cwd=folder, check=True)


def repository(folder, readme):
    (folder / ".ci").mkdir(parents=True)
    shutil.copy(ROOT / ".ci" / "run", folder / ".ci" / "run")
    (folder / "README.md").write_text(readme)
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-q", "-m", "Start")
    return folder


def run(folder, scratch):
    scratch.mkdir()
    return subprocess.run(
        [folder / ".ci" / "run"],
        env=os.environ | {"TMPDIR": str(scratch)},
        capture_output=True,
        text=True,
        timeout=60,
    )


def test_readme_command_runs_as_written_on_the_committed_files(tmp_path):
    checkout = repository(
        tmp_path / "a b", README.format(tail="ls -a . && echo '3 passed'")
    )
    (checkout / "uncommitted.txt").touch()
    done = run(checkout, tmp_path / "scratch")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "3 passed"
    assert "README.md" in done.stdout
    assert "uncommitted.txt" not in done.stdout
    assert list((tmp_path / "scratch").iterdir()) == []


def test_failing_command_fails_the_run(tmp_path):
    checkout = repository(tmp_path / "r", README.format(tail="false | cat"))
    assert run(checkout, tmp_path / "scratch").returncode == 1


@pytest.mark.parametrize(
    ("readme", "message"),
    [
        ("# Title\n", "no fenced block"),
        ("<!-- test-command -->\n```\npytest\n```\n", "no 'git clone <url>"),
    ],
)
def test_readme_without_a_usable_command_is_an_error(tmp_path, readme, message):
    done = run(repository(tmp_path / "r", readme), tmp_path / "scratch")
    assert done.returncode == 2
    assert message in done.stderr


def test_readme_of_this_repository_holds_the_command():
    readme = (ROOT / "README.md").read_text()
    block = readme.split("<!-- test-command -->\n", 1)[1].split("```")[1]
    assert "git clone " in block
    assert "python3 -m venv .venv" in block
    assert "pytest" in block
