"""Verbs about a corpus: plan, splits, build."""

import argparse
from contextlib import suppress
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    add_corpus_options,
    add_ray,
    add_workers,
    named_lists,
    named_profile,
    named_subset,
    new_verb,
    read_params,
    say,
    setting,
)
from mpmworlds.cli.materialise import render_rows


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

    done = write_plan(
        named_profile(options),
        options.out,
        workers=options.workers,
        ray=options.ray,
        trials=options.trials or RECORDED,
    )
    if options.record_trials:
        write_recorded(options.record_trials, done.trials)
    for kind, reasons in done.rejected.items():
        counts = ", ".join(f"{reason} {n}" for reason, n in reasons.items())
        say(f"candidates for {kind} rejected: {counts or 'none'}")
    print(f"{options.out}: {len(done.rows)} scenes")
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
    parser.add_argument(
        "--check", action="store_true", help="recompute and compare, write nothing"
    )


def splits(options: argparse.Namespace) -> int:
    """Record or check the lists of a corpus."""
    from mpmworlds.builder.plan.manifest import read_table
    from mpmworlds.builder.plan.profile import sample_ids
    from mpmworlds.splits.lists import compute_lists
    from mpmworlds.splits.manifest import check, read_lists, write_lists

    profile, lists = named_profile(options), named_lists(options)
    folder = options.dir or _recorded_lists(options)
    if options.manifest:
        ids = read_table(options.manifest, ["id"])["id"].to_pylist()
    else:
        ids = sample_ids(profile)
    if options.check:
        differences = check(folder, ids, profile.split, lists)
        sizes = "" if differences else f"{_sizes(read_lists(folder))}, as computed"
        print("\n".join(differences) or f"{folder}: {sizes}")
        return DOES_NOT_HOLD if differences else DONE
    computed = compute_lists(ids, profile.split, lists)
    write_lists(folder, computed)
    print(f"{folder}: {_sizes(computed)}")
    return DONE


def _recorded_lists(options: argparse.Namespace) -> Path:
    """Folder of the lists that come with the package."""
    from mpmworlds.splits.manifest import RECORDED

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


def add_build(verbs: Any) -> None:
    """Add the verb `build`."""
    parser = new_verb(
        verbs,
        build,
        "build a release: plan, render what is missing, write the shards",
        "mpmworlds build --config tiny --out release/mpmworlds",
    )
    add_corpus_options(parser, store=True)
    parser.add_argument("--manifest", type=Path, help="build from this plan")
    parser.add_argument("--out", type=Path, required=True, help="folder of the release")


def build(options: argparse.Namespace) -> int:
    """Build a release folder."""
    from mpmworlds.builder.plan.manifest import read_manifest
    from mpmworlds.builder.plan.profile import Profile
    from mpmworlds.builder.release.build import build_release
    from mpmworlds.builder.render.store import Store
    from mpmworlds.splits.lists import ListParams, compute_lists

    params, store = read_params(options), Store(options.store)
    version = setting(params, "version", str)
    profile, ids = named_subset(options)
    planned = Profile.from_params(params, profile)
    rows_per_shard = setting(
        params["profiles"][profile], "rows_per_shard", int, f"profile {profile!r}: "
    )
    manifest = options.manifest or _manifest(options, profile)
    rows = read_manifest(manifest)
    lists = compute_lists(
        [row.id for row in rows],
        planned.split,
        ListParams.from_params(params, profile),
    )
    rows = [row for row in rows if ids is None or row.id in ids]
    if render_rows(rows, store, options.workers).failures:
        say(f"{options.out}: not built, because scenes failed")
        return DOES_NOT_HOLD
    shards = build_release(
        manifest,
        store,
        options.out,
        {options.config: ids},
        version=version,
        lists=lists,
        rows_per_shard=rows_per_shard,
        workers=options.workers,
    )
    print(f"{options.out}: {len(shards)} shards")
    return DONE


def _manifest(options: argparse.Namespace, name: str) -> Path:
    """The recorded manifest of a profile, or one that is planned now."""
    from mpmworlds.builder.plan.manifest import recorded_manifest
    from mpmworlds.builder.plan.plan import write_plan
    from mpmworlds.builder.plan.profile import Profile
    from mpmworlds.builder.plan.trials import RECORDED

    if not options.params:  # else the recorded one is of other parameters
        with suppress(LookupError):
            return recorded_manifest(name)
    path: Path = options.store / f"{name}.parquet"
    profile = Profile.from_params(read_params(options), name)
    write_plan(profile, path, workers=options.workers, trials=RECORDED)
    return path
