"""The verb that says what this machine can do."""

import json
import os
import subprocess
import sys

import pytest

NEEDED = {"sandbox", "exact videos", "compiler", "Python", "disk for work"}


def test_a_machine_that_has_all_is_told_so(command):
    status, out, err = command("doctor", "--json")
    checks = {check["what"]: check for check in json.loads(out)}
    assert (status, err) == (0, "")
    assert checks.keys() >= NEEDED
    assert all(check["good"] for check in checks.values() if check["needed"])
    assert all(bool(check["costs"]) != check["good"] for check in checks.values())


def test_the_table_has_a_line_for_each_check(command):
    status, out, _ = command("doctor")
    assert status == 0
    assert all(any(what in line for line in out.splitlines()) for what in NEEDED)


def test_no_library_speaks_amid_the_table(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mpmworlds", "doctor", "--dir", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert "videos of `python program.py`" in done.stdout
    assert done.stderr == ""


def test_gpus_are_those_that_the_driver_tells(command, tmp_path, monkeypatch):
    tool = tmp_path / "nvidia-smi"
    tool.write_text("#!/bin/sh\necho 'NVIDIA Some, 1024 MiB'\n")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    _, out, _ = command("doctor", "--json")
    (gpu,) = [check for check in json.loads(out) if check["what"] == "GPU"]
    assert (gpu["found"], gpu["good"]) == ("NVIDIA Some, 1024 MiB", True)
    tool.write_text("#!/bin/sh\nexit 9\n")  # a driver that is not there
    _, out, _ = command("doctor", "--json")
    (gpu,) = [check for check in json.loads(out) if check["what"] == "GPU"]
    assert (gpu["found"], gpu["good"], gpu["needed"]) == ("none", False, False)


@pytest.mark.skipif(os.getuid() != 0, reason="only the superuser can be others")
@pytest.mark.parametrize(
    ("denied", "status", "told"),
    [
        (["unshare"], 0, "lockdown is the only layer"),
        (["landlock_create_ruleset"], 0, "files are hidden by namespaces alone"),
        (["unshare", "landlock_create_ruleset"], 1, "no programs but those of scenes"),
    ],
    ids=["namespaces", "Landlock", "both"],
)
def test_what_is_missing_is_told_with_what_it_costs(denied, status, told):
    script = (
        "import sys; from tests.sim.sandbox.confined import deny; "
        "from mpmworlds.cli import main; "
        f"deny({denied}); sys.exit(main(['doctor']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, told in done.stdout) == (status, True), done
