"""Verbs about a corpus: plan, splits, build."""

import argparse
from collections import Counter
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    add_corpus_options,
    add_measured,
    add_ray,
    add_workers,
    new_verb,
    parameters,
    say,
)
from mpmworlds.cli.materialise import tell
from mpmworlds.files.targets import check_file


def add_plan(verbs: Any) -> None:
    """Add the verb `plan`."""
    parser = new_verb(
        verbs,
        plan,
        "plan a corpus: write the manifest of all its scenes",
        "mpmworlds plan --config tiny --out work/tiny/manifest.parquet",
    )
    add_corpus_options(parser, store=False)
    parser.add_argument("--out", type=Path, required=True, help="manifest to write")
    add_workers(parser)
    add_ray(parser)
    parser.add_argument(
        "--trials",
        type=Path,
        help="findings of trials that need not be run again (default: the recorded)",
    )
    parser.add_argument(
        "--record-trials", type=Path, help="write all findings that it rests on here"
    )


def plan(options: argparse.Namespace) -> int:
    """Write the manifest of a profile."""
    from mpmworlds.builder.plan.plan import write_plan
    from mpmworlds.builder.plan.trials import RECORDED, write_recorded

    check_file(options.record_trials)
    done = write_plan(
        parameters(options).profile(options.config),
        options.out,
        workers=options.workers,
        ray=options.ray,
        trials=[options.trials] if options.trials else RECORDED,
    )
    if options.record_trials:
        write_recorded(options.record_trials, done.trials)
    for kind, reasons in done.rejected.items():
        counts = ", ".join(f"{reason} {n}" for reason, n in reasons.items())
        say(f"candidates for {kind} rejected: {counts or 'none'}")
    print(f"{options.out}: {len(done.rows)} scenes")
    return DONE


def add_measure(verbs: Any) -> None:
    """Add the verb `measure`."""
    parser = new_verb(
        verbs,
        measure,
        "run the samples to evaluate on in full: those that hardly move after the "
        "prefix, or are mere chaos, are passed over by the lists",
        "mpmworlds measure --config full --out measured.parquet",
    )
    add_corpus_options(parser, store=False, default="full")
    parser.add_argument("--manifest", type=Path, help="default: the recorded one")
    parser.add_argument("--out", type=Path, required=True, help="table to write")
    add_workers(parser)
    add_ray(parser)


def measure(options: argparse.Namespace) -> int:
    """Measure the samples of the evaluation lists."""
    from mpmworlds.builder.plan.evaluation import measure_lists
    from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest

    params = parameters(options)
    found = measure_lists(
        read_manifest(options.manifest or recorded_manifest(options.config)),
        params.profile(options.config).split,
        params.list_params(options.config),
        options.out,
        workers=options.workers,
        ray=options.ray,
    )
    faults = Counter(m.fault for m in found if m.fault)
    told = ", ".join(f"{n} {fault}" for fault, n in sorted(faults.items()))
    print(f"{options.out}: {len(found)} samples, passed over: {told or 'none'}")
    return DONE


def add_splits(verbs: Any) -> None:
    """Add the verb `splits`."""
    parser = new_verb(
        verbs,
        splits,
        "record the splits, evaluation lists and subsets of a corpus, or check them",
        "mpmworlds splits --check --config full",
    )
    add_corpus_options(parser, store=False)
    parser.add_argument("--manifest", type=Path, help="its ids; planned anew if absent")
    parser.add_argument(
        "--dir",
        type=Path,
        help="folder of the lists (default, with --check: those in the package)",
    )
    add_measured(parser)
    parser.add_argument(
        "--check", action="store_true", help="recompute and compare, write nothing"
    )


def splits(options: argparse.Namespace) -> int:
    """Record or check the lists of a corpus."""
    from mpmworlds.builder.plan.manifest import read_table
    from mpmworlds.builder.plan.profile import sample_ids
    from mpmworlds.splits.recorded_lists import differences, read_lists, write_lists

    params = parameters(options)
    profile = params.profile(options.config)
    folder = options.dir or _recorded_lists(options)
    if options.manifest:
        ids = read_table(options.manifest, ["id"])["id"].to_pylist()
    else:
        ids = sample_ids(profile)
    computed = params.lists_of(options.config, ids)
    if options.check:
        wrong = differences(folder, computed)
        sizes = "" if wrong else f"{_sizes(read_lists(folder))}, as computed"
        print("\n".join(wrong) or f"{folder}: {sizes}")
        return DOES_NOT_HOLD if wrong else DONE
    write_lists(folder, computed)
    print(f"{folder}: {_sizes(computed)}")
    return DONE


def _recorded_lists(options: argparse.Namespace) -> Path:
    """Folder of the lists that come with the package."""
    from mpmworlds.splits.recorded_lists import RECORDED

    if not options.check:
        raise ValueError("--dir: is missing; name the folder to write the lists to")
    folder = Path(str(RECORDED / options.config))
    if options.params or options.manifest or not folder.is_dir():
        raise ValueError(
            "--dir: is missing; name the folder of the lists to check (the package "
            "has those of its own profiles only)"
        )
    return folder


def _sizes(lists: Any) -> str:
    return ", ".join(f"{name} {len(ids)}" for name, ids in lists.items())


_CONFIGURATIONS = """
configurations of the package's parameters:
  tiny         a dozen small scenes of their own, to try things out
  mini         100 samples: 60 train, 16 modification_validation, 24 test
  evaluation   the 152 test and 88 modification_validation samples to evaluate on
  10k          10,000 samples, those to evaluate on among them
  full         all 95,805
  NAME-clips   those of NAME with videos of 256 px and 15 frames per second only
  preview      those of mini, in videos that play everywhere and are not exact
recipes, all scenes without videos, is part of every release.

more examples:
  two configurations, into a release that may have others, which stay:
    mpmworlds build --config mini --config mini-clips --out release/mpmworlds
"""


def add_build(verbs: Any) -> None:
    """Add the verb `build`."""
    parser = new_verb(
        verbs,
        build,
        "build a release: plan, render what is missing, write the shards",
        "mpmworlds build --config tiny --out release/mpmworlds",
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog += f"\n{_CONFIGURATIONS}"
    add_corpus_options(parser, store=True, several=True)
    parser.add_argument("--manifest", type=Path, help="build from this plan")
    add_measured(parser)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        help="folder of the release; what it has and is not named here stays",
    )


def build(options: argparse.Namespace) -> int:
    """Build a release folder."""
    from mpmworlds.builder.release.corpus import build_corpus
    from mpmworlds.builder.render.store import Store

    done, built = build_corpus(
        parameters(options),
        options.config or ["tiny"],
        Store(options.store),
        options.out,
        manifest=options.manifest,
        workers=options.workers,
    )
    tell(done, options.store)
    if built is None:
        say(f"{options.out}: not built, because scenes failed")
        return DOES_NOT_HOLD
    for what in ("added", "replaced", "unchanged", "kept"):
        if names := getattr(built, what):
            say(f"{options.out}: {what}: {', '.join(names)}")
    print(f"{options.out}: {len(built.record.files())} shards")
    return DONE
