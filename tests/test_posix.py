"""Without the modules of POSIX a release is read, and all else says one clear line."""

import json
import os
import subprocess
import sys
import textwrap

import pytest

from mpmworlds.builder.seeds import load_seeds

BLOCKED = """\
import json, sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name in ("fcntl", "resource"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

for name in ("fcntl", "resource"):
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Blocked())
"""


@pytest.fixture
def elsewhere(tmp_path):
    """Function that runs statements without these modules -> status, output, errors."""

    def run(statements, *arguments):
        done = subprocess.run(
            [sys.executable, "-c", BLOCKED + textwrap.dedent(statements), *arguments],
            cwd=tmp_path,
            env=os.environ
            | {"HF_HOME": str(tmp_path / "hf"), "HF_HUB_OFFLINE": "1"}
            | {"XDG_CACHE_HOME": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout, done.stderr

    return run


def test_a_release_is_read(elsewhere, release):
    status, out, err = elsewhere(
        """
        import mpmworlds
        from datasets import load_dataset

        root = sys.argv[1]
        (one,) = mpmworlds.load(root, ids=["p0002"])
        stream = load_dataset(root, "mini", split="test", streaming=True)
        found = {
            "load": [row.id for row in mpmworlds.load(root, "test", "tiny")],
            "id": [one.id, list(one.prefix.shape)],
            "load_dataset": load_dataset(root, "tiny", split="test")["id"],
            "stream": [row["id"] for row in stream],
        }
        print(json.dumps({k: list(v) for k, v in found.items()}))
        """,
        str(release),
    )
    assert status == 0, err
    assert json.loads(out.splitlines()[-1]) == {
        "load": ["p0002", "p0002-n00"],
        "id": ["p0002", [6, 64, 64, 3]],
        "load_dataset": ["p0002", "p0002-n00"],
        "stream": ["p0002"],
    }


@pytest.mark.parametrize(
    ("arguments", "module"),
    [
        (("build", "--config", "tiny", "--out", "here"), "resource"),
        (("run", "scene.yaml", "--out", "video.mp4"), "resource"),
        (("fetch", "p0002", "--release", "{release}"), "fcntl"),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_a_command_says_what_is_missing(
    elsewhere, release, tmp_path, arguments, module
):
    seed = next(iter(load_seeds().values())).to_yaml()
    (tmp_path / "scene.yaml").write_text(seed)
    told = [argument.format(release=release) for argument in arguments]
    status, out, err = elsewhere(
        "from mpmworlds.cli import main\nsys.exit(main(sys.argv[1:]))", *told
    )
    said = [line for line in err.splitlines() if line.startswith("mpmworlds ")]
    assert (status, out, len(said)) == (2, "", 1), err
    assert f"has no '{module}'" in said[0]
    assert "use Linux" in said[0]
    assert "Traceback" not in err


def test_so_does_the_python_name(elsewhere):
    status, _, err = elsewhere("import mpmworlds\nmpmworlds.run('')")
    assert status == 1
    assert "NotPosixError: this operating system" in err.splitlines()[-1]
