"""The script that continuous integration runs, on small repositories of its own."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = """# Title

<!-- first-command -->
```bash
{first}
```

<!-- test-command -->
```bash
{test}
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


def command_after(mark):
    """The command of this repository's README after a comment."""
    readme = (ROOT / "README.md").read_text()
    return readme.split(f"<!-- {mark} -->\n```bash\n", 1)[1].split("```")[0]


def test_both_commands_run_as_written_in_one_clone_of_the_committed_files(tmp_path):
    readme = README.format(first="ls -a . && touch made", test="ls && echo '3 passed'")
    checkout = repository(tmp_path / "a b", readme)
    (checkout / "uncommitted.txt").touch()
    done = run(checkout, tmp_path / "scratch")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-3:] == ["README.md", "made", "3 passed"]
    assert ".ci" in done.stdout
    assert "uncommitted.txt" not in done.stdout
    assert list((tmp_path / "scratch").iterdir()) == []
    assert not (checkout / "made").exists()


@pytest.mark.parametrize(
    ("first", "test"), [("false && echo", "true"), ("true", "false | cat")]
)
def test_failing_command_fails_the_run(tmp_path, first, test):
    readme = README.format(first=first, test=test)
    assert run(repository(tmp_path / "r", readme), tmp_path / "scratch").returncode == 1


def test_nothing_runs_after_a_first_command_that_failed(tmp_path):
    readme = README.format(first="false", test="echo '3 passed'")
    assert run(repository(tmp_path / "r", readme), tmp_path / "scratch").stdout == ""


@pytest.mark.parametrize("instead", ["<!-- another -->", "{}\nWords."])
@pytest.mark.parametrize("mark", ["first-command", "test-command"])
def test_readme_without_a_marked_block_is_an_error(tmp_path, mark, instead):
    readme = README.format(first="echo ran", test="echo ran")
    readme = readme.replace(f"<!-- {mark} -->", instead.format(f"<!-- {mark} -->"))
    done = run(repository(tmp_path / "r", readme), tmp_path / "scratch")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f".ci/run: README.md has no fenced block after <!-- {mark} -->\n"
    )


def test_readme_of_this_repository_holds_both_commands():
    first, test = command_after("first-command"), command_after("test-command")
    for command in (first, test):
        assert command.startswith("python3 -m venv .venv && .venv/bin/pip install ")
    assert "mpmworlds build --config tiny" in first
    assert "pytest" in test
