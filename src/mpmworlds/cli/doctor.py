"""The verb that says what this machine can do."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpmworlds.cli.common import DOES_NOT_HOLD, DONE, new_verb
from mpmworlds.files.quiet import errors_unsaid

if TYPE_CHECKING:
    from mpmworlds.sim.run.machine import Check


def add_doctor(verbs: Any) -> None:
    """Add the verb `doctor`."""
    parser = new_verb(
        verbs,
        doctor,
        "say what this machine has, and what each missing part costs",
        "mpmworlds doctor",
    )
    parser.add_argument(
        "--dir", type=Path, default=Path("work"), help="where work is to lie"
    )
    parser.add_argument("--json", action="store_true", help="print the checks as JSON")


def doctor(options: argparse.Namespace) -> int:
    """Look at the machine; 1 if something that is needed is missing."""
    checks = []
    for check in _checks(options.dir):
        checks.append(check)
        if not options.json:
            mark = "ok" if check.good else "MISSING" if check.needed else "-"
            print(f"{mark:8}{check.what:32}{check.found}")
            if check.costs:
                print(f"{'':8}{check.costs}")
    if options.json:
        print(json.dumps([check._asdict() for check in checks]))
    bad = any(check.needed and not check.good for check in checks)
    return DOES_NOT_HOLD if bad else DONE


def _checks(folder: Path) -> "Iterator[Check]":
    """What is found, one after another; the table says it, no library does."""
    from mpmworlds.sim.run.machine import examine

    checks = examine(folder)
    while True:
        with errors_unsaid():
            check = next(checks, None)
        if check is None:
            return
        yield check
