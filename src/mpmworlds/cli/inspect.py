"""Verbs that look at a manifest: stats, audit."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    new_verb,
    parameters,
    say,
)


def _add_which(parser: Any) -> None:
    """Add the options that say which manifest."""
    parser.add_argument(
        "--manifest", type=Path, help="default: the recorded one of the profile"
    )
    parser.add_argument(
        "--config", help="profile in params.yaml (default, without --manifest: full)"
    )


def _manifest(options: argparse.Namespace) -> Path:
    """The manifest that was asked for."""
    from mpmworlds.builder.plan.manifest import recorded_manifest

    if options.config:
        parameters(options).refuse_subset(options.config)
    if options.manifest:
        return Path(options.manifest)
    if options.params:
        raise ValueError(
            "--params: the recorded manifest is of other parameters; name one of these "
            "with --manifest FILE"
        )
    options.config = options.config or "full"
    return recorded_manifest(options.config)


def add_stats(verbs: Any) -> None:
    """Add the verb `stats`."""
    parser = new_verb(
        verbs,
        stats,
        "print the statistics of a corpus beside those of the paper",
        "mpmworlds stats --manifest work/tiny/manifest.parquet --figure stats.svg",
    )
    _add_which(parser)
    parser.set_defaults(params=None)
    parser.add_argument(
        "--by-split", action="store_true", help="a column for each split as well"
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="exit with 1 if the corpus is too far from the paper's numbers",
    )
    parser.add_argument(
        "--figure", type=Path, help="draw a figure too (.png, .svg or .pdf)"
    )
    parser.add_argument("--json", action="store_true", help="print them as JSON")


def stats(options: argparse.Namespace) -> int:
    """Count a manifest and hold it to the targets."""
    from mpmworlds.builder.plan.manifest import read_table
    from mpmworlds.builder.statistics.counts import (
        COUNTED,
        STRUCTURED,
        count_by_split,
        count_structures,
        count_table,
    )
    from mpmworlds.builder.statistics.figure import write_figure
    from mpmworlds.builder.statistics.table import statistics_data, statistics_table
    from mpmworlds.builder.statistics.targets import verdicts

    manifest = _manifest(options)
    table = read_table(manifest, COUNTED)
    whole = count_table(table)
    columns = {"all": whole} | (count_by_split(table) if options.by_split else {})
    structures = count_structures(read_table(manifest, STRUCTURED))
    if options.figure:
        write_figure(whole, options.figure)
        say(f"{options.figure}: written")
    if options.json:
        print(json.dumps(statistics_data(columns, structures)))
    else:
        print(statistics_table(columns, structures))
    failed = not all(verdict.holds for verdict in verdicts(whole))
    return DOES_NOT_HOLD if options.check and failed else DONE


def add_audit(verbs: Any) -> None:
    """Add the verb `audit`."""
    parser = new_verb(
        verbs,
        audit,
        "audit a corpus: no family, scene or near duplicate in two splits",
        "mpmworlds audit --config tiny --manifest work/tiny/manifest.parquet",
    )
    _add_which(parser)
    parser.add_argument("--params", type=Path, help="another params.yaml")
    parser.add_argument(
        "--near",
        type=float,
        metavar="DISTANCE",
        help="config distance of scenes that are too near (default 0.05)",
    )
    parser.add_argument("--json", action="store_true", help="print findings as JSON")


def audit(options: argparse.Namespace) -> int:
    """Look for leaks between the splits of a corpus."""
    from mpmworlds.builder.plan.manifest import read_table
    from mpmworlds.splits.audit import audit as run_audit
    from mpmworlds.splits.audit_records import Record
    from mpmworlds.splits.near_duplicates import NEAR

    manifest = _manifest(options)
    if not options.config:
        raise ValueError(
            "--config: is missing; name the profile whose splits the manifest has"
        )
    params = parameters(options).profile(options.config).split
    table = read_table(manifest, Record._fields)
    columns = [table[name].to_pylist() for name in Record._fields]
    near = NEAR if options.near is None else options.near
    found = run_audit(list(map(Record, *columns)), params, near)
    if options.json:
        print(json.dumps({"manifest": str(manifest)} | asdict(found)))
        return DOES_NOT_HOLD if found.problems else DONE
    for problem in found.problems:
        print(problem)
    verdict = f"{len(found.problems):,} problems" if found.problems else "no leak"
    counts = f"{found.samples:,} samples, {found.templates:,} templates"
    print(f"{manifest}: {counts} compared by distance: {verdict}")
    if found.kin:
        print(
            f"{len(found.kin):,} pairs of a modification and a training scene of its "
            f"own family are near, as they are meant to be; nearest: {found.kin[0]}"
        )
    return DOES_NOT_HOLD if found.problems else DONE
