"""Verbs that compare results: gate, report."""

import argparse
import json
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import DONE, new_verb, say

GATE = "gate.json"


def add_gate(verbs: Any) -> None:
    """Add the verb `gate`."""
    parser = new_verb(
        verbs,
        gate,
        "fit the prefix-quality gate of two systems, and apply it to another split",
        "mpmworlds gate --fit results/search-modified results/copy_last-modified "
        "--apply results/search-test results/copy_last-test",
    )
    for option, what in (
        ("--fit", "results of both on modification_validation"),
        ("--apply", "results of both on another split, where nothing is fitted"),
    ):
        parser.add_argument(
            option,
            nargs=2,
            type=Path,
            required=option == "--fit",
            metavar=("PROGRAM", "FALLBACK"),
            help=what,
        )
    parser.add_argument("--out", type=Path, help=f"folder to write {GATE} to")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")


def gate(options: argparse.Namespace) -> int:
    """Fit, apply, and print both."""
    from mpmworlds.baselines.gate import gate_table, read_gate
    from mpmworlds.files.atomic import write_atomically
    from mpmworlds.files.targets import check_folder

    if options.out:
        check_folder(options.out)
    report = read_gate(options.fit, options.apply)
    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    if options.out:
        write_atomically(options.out / GATE, text.encode())
    print(json.dumps(report) if options.json else gate_table(report), end="")
    return DONE


def add_report(verbs: Any) -> None:
    """Add the verb `report`."""
    parser = new_verb(
        verbs,
        report,
        "compare results: tables, ranking, figures and a page to look at",
        "mpmworlds report work/results/copy_last work/results/black --out work/report",
    )
    parser.add_argument(
        "results",
        nargs="+",
        metavar="RESULTS",
        help="folder of an evaluation, or NAME=FOLDER to name its system",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--release", type=Path, help="release of the samples: coverage and references"
    )
    parser.add_argument(
        "--common",
        action="store_true",
        help="compare over the samples that all systems of a split have",
    )
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")


def report(options: argparse.Namespace) -> int:
    """Write the report and print where it is, and the ranking."""
    from mpmworlds.baselines.report.write import write_report

    written = write_report(
        options.results, options.out, options.release, common=options.common
    )
    for note in written.data["notes"]:
        say(note)
    print(json.dumps(written.data) if options.json else written.text, end="")
    return DONE
