"""The verb that turns rows of a manifest into videos."""

import argparse
import json
import os
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    add_corpus_options,
    add_ray,
    new_verb,
    parameters,
    say,
)
from mpmworlds.files.targets import check_file
from mpmworlds.files.text import read_text

SELECTION = ("split", "kind", "where", "sample", "limit")
MORE = """
A row is rendered if it satisfies all options of the selection.
What is in the store is never rendered again, so the same command goes on where it was
stopped, and several may work on one store at once.

more examples:
  two samples of the full corpus:
    mpmworlds materialise p0123 p0123-c4-n07
  how long 500 scenes with sand and something else would take, and how many bytes:
    mpmworlds materialise --split train --sample 500 --dry-run \\
      --where "'sand' in materials and num_materials > 1"
  all of a small subset of the full corpus:
    mpmworlds materialise --config mini
  the samples of a list, on the Ray cluster that this machine is part of:
    mpmworlds materialise --ids test.txt --ray auto

conditions, in SQL as DuckDB has it, on the columns
  id, kind, split, family_id, parent_id, edit     edit = 'add_object'
  seeds, materials, object_types                  'sand' in materials
  num_objects, num_materials, motion     motion > 0.2
  scene (its YAML)                                contains(scene, 'conveyor')

files in the store, besides the samples:
  failures.jsonl   samples that failed in the last run, why, after how many attempts;
                   of a second run at the same time: failures-2.jsonl, and so on
  log.jsonl        seconds and bytes of each rendered sample
"""


def add_materialise(verbs: Any) -> None:
    """Add the verb `materialise`."""
    parser = new_verb(
        verbs,
        materialise,
        "render the scenes of a manifest into the store, resumably",
        "mpmworlds materialise p0123-c4",
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog += f"\n{MORE}"
    add_corpus_options(parser, store=True, default=None)
    parser.add_argument(
        "--manifest", type=Path, help="all rows (default: the recorded ones of CONFIG)"
    )
    add_ray(parser)
    parser.add_argument(
        "--failures",
        type=Path,
        help="record failures here (default STORE/failures.jsonl, or failures-2.jsonl "
        "and so on while another run writes that)",
    )
    parser.add_argument(
        "--record", type=Path, help="write the hashes of all videos here (.jsonl)"
    )
    _add_selection(parser.add_argument_group("selection"))
    asked = parser.add_argument_group("answers")
    asked.add_argument(
        "--list-ids", action="store_true", help="print the selected ids, render nothing"
    )
    asked.add_argument(
        "--dry-run",
        action="store_true",
        help="say how many rows, what they would take and need, render nothing",
    )
    asked.add_argument("--json", action="store_true", help="print a summary as JSON")


def _add_selection(group: Any) -> None:
    from mpmworlds.splits.ids import SAMPLE_KINDS

    group.add_argument("id", nargs="*", metavar="ID", help="ids of samples")
    group.add_argument("--ids", type=Path, metavar="FILE", help="more ids, one a line")
    group.add_argument("--split", metavar="NAME", help="rows of this split")
    group.add_argument("--kind", choices=SAMPLE_KINDS, help="rows of this kind")
    group.add_argument("--where", metavar="CONDITION", help="rows that satisfy this")
    group.add_argument(
        "--sample", type=int, metavar="N", help="draw N of them, always the same ones"
    )
    group.add_argument("--limit", type=int, metavar="N", help="the first N of them")


def materialise(options: argparse.Namespace) -> int:
    """Render what the store lacks."""
    from mpmworlds.builder.render.materialise import render_rows, write_record
    from mpmworlds.builder.render.store import Store

    rows, store = _read_rows(options), Store(options.store)
    chosen = _select(rows, options)
    if options.list_ids:
        print("\n".join(row.id for row in chosen))
        return DONE
    if options.dry_run:
        return _foretell(rows, chosen, store, options)
    check_file(options.record)
    done, path = render_rows(
        chosen,
        store,
        workers=options.workers,
        ray=options.ray,
        failures=options.failures,
    )
    tell(done, options.store, path)
    if options.record and not done.failures:
        write_record(options.record, chosen, store)
    if options.json:
        print(json.dumps(done.summary()))
    return DOES_NOT_HOLD if done.failures else DONE


def _read_rows(options: argparse.Namespace) -> Any:
    """All rows of the manifest that is named, or recorded."""
    from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest

    names = ("config", "manifest", "id", "ids", *SELECTION, "list_ids", "dry_run")
    given = [getattr(options, name) for name in names]
    if all(value is None or value is False or value == [] for value in given):
        raise ValueError(
            "what to render? Name ids, select with --split, --kind, --where or "
            "--sample, or say --config full for the whole corpus; --dry-run says how "
            "long that would take"
        )
    options.config = options.config or "full"
    profile, ids = parameters(options).subset(options.config)
    if options.params and not options.manifest:
        raise ValueError(
            "--params: the recorded manifest is of other parameters; plan one with "
            f"them: mpmworlds plan --params {options.params} --config {profile} --out "
            "FILE, and name it with --manifest FILE"
        )
    rows = read_manifest(options.manifest or recorded_manifest(profile))
    return rows if ids is None else [row for row in rows if row.id in ids]


def _select(rows: Any, options: argparse.Namespace) -> Any:
    from mpmworlds.builder.plan.select import select

    ids = [*options.id, *(read_text(options.ids).split() if options.ids else ())]
    if options.ids and not ids:
        raise ValueError(f"{options.ids}: holds no ids, must have one a line")
    chosen = select(rows, ids, **{name: getattr(options, name) for name in SELECTION})
    if rows and not chosen:
        raise ValueError(f"none of the {len(rows)} rows satisfies all that is asked")
    return chosen


def tell(done: Any, store: Path, failures: Path | None = None) -> None:
    """Say what became of samples."""
    say(
        f"{store}: {done.rendered} rendered, {done.reused} there before, "
        f"{len(done.failures)} failed"
    )
    if done.rendered:
        say(
            f"{done.seconds:.1f} s; {done.simulation_seconds:.1f} s of simulation and "
            f"{done.encoding_seconds:.1f} s of encoding on all cores together; "
            f"{done.bytes / 1e6:.2f} MB"
        )
    for kind, found in done.failures_by_kind().items():
        say(f"{kind}: {len(found)} failed, such as {found[0].id}: {found[0].reason}")
    if done.failures and failures:
        say(f"{failures}: names them all")


def _foretell(rows: Any, chosen: Any, store: Any, options: argparse.Namespace) -> int:
    """Say what rendering the chosen rows would take."""
    from mpmworlds.builder.render.timings import estimate

    there = sum(store.has(row.program_sha256) for row in chosen)
    missing = len(chosen) - there
    workers = options.workers or os.cpu_count() or 1
    # Rows of one manifest are alike: they have the same resolution and length.
    found = estimate(missing, store.root, {row.program_sha256 for row in rows})
    if options.json:
        answer = {"selected": len(chosen), "in_store": there, "to_render": missing}
        if found:
            answer |= found.summary(workers)
        print(json.dumps(answer))
        return DONE
    print(f"{len(chosen)} selected, {there} in the store, {missing} to render")
    if found and missing:
        print(
            f"about {_duration(found.core_seconds / workers)} with {workers} at a time "
            f"and {found.bytes / 1e6:.1f} MB, judging by {found.measured} rendered rows"
        )
    elif missing:
        print("no estimate: render a few of these rows first, with --limit 4")
    return DONE


def _duration(seconds: float) -> str:
    for unit, size in (("days", 86400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} seconds"
