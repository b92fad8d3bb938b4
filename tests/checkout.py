"""A copy of this repository in which a test runs DVC."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


class Checkout:
    """A copy of the repository and of nothing that was generated in it."""

    def __init__(self, folder, name="checkout"):
        self.folder = folder / name
        self.home = folder / f"{name}-home"

    @classmethod
    def of_now(cls, folder):
        """Copy the files of this checkout."""
        copy = cls(folder)
        listed = ["git", "ls-files", "-co", "--exclude-standard", "-z"]
        done = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True)
        for name in sorted(done.stdout.decode().split("\0")[:-1]):
            if os.path.lexists(ROOT / name):
                (copy.folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, copy.folder / name, follow_symlinks=False)
        copy.git("init", "-q")
        return copy

    def git(self, *arguments):
        """Run git as nobody in particular."""
        who = ["-c", "user.name=test", "-c", "user.email=test@example.org"]
        command = ["git", *who, *arguments]
        subprocess.run(command, cwd=self.folder, check=True, capture_output=True)

    def clone(self, name):
        """Clone what is committed, with no caches in common."""
        other = Checkout(self.folder.parent, name)
        self.git("clone", "-q", str(self.folder), str(other.folder))
        return other

    def dvc(self, *arguments, **settings):
        """Run dvc where `python` and `mpmworlds` are those of the copy."""
        environment = os.environ | {
            "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
            "PYTHONPATH": str(self.folder / "src"),
            "PYTHONDONTWRITEBYTECODE": "",  # a user's Python leaves byte code
            "XDG_CACHE_HOME": str(self.home / "cache"),
            "DVC_SITE_CACHE_DIR": str(self.home / "site"),
            "DVC_GLOBAL_CONFIG_DIR": str(self.home / "global"),
            "DVC_SYSTEM_CONFIG_DIR": str(self.home / "system"),
            **settings,
        }
        done = subprocess.run(
            [sys.executable, "-m", "dvc", *arguments],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def repro(self):
        """Return the stages that ran, of those that the tiny results need."""
        out = self.dvc("repro", "split@tiny", "evaluate")
        return re.findall(r"^Running stage '([\w@]+)'", out, re.MULTILINE)

    def set(self, old, new):
        """Change one place of params.yaml."""
        path = self.folder / "params.yaml"
        text = path.read_text()
        assert text.count(old) == 1
        path.write_text(text.replace(old, new))

    def read(self, name):
        return (self.folder / name).read_bytes()
