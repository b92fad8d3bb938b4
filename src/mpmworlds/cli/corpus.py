"""Verbs about a corpus: plan, splits, materialise, build."""

import argparse
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    named_profile,
    new_verb,
    read_params,
    say,
    setting,
)

STORE = Path("work/store")


def add_corpus_options(parser: Any, *, store: bool) -> None:
    """Add the options that say which corpus, and which store if there is one."""
    parser.add_argument(
        "--config", default="tiny", help="profile in params.yaml (default tiny)"
    )
    parser.add_argument("--params", type=Path, help="another params.yaml")
    if store:
        parser.add_argument(
            "--store",
            type=Path,
            default=STORE,
            help=f"folder of rendered samples (default {STORE})",
        )
        parser.add_argument(
            "--workers", type=int, default=0, help="processes (default: one per core)"
        )


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


def plan(options: argparse.Namespace) -> int:
    """Write the manifest of a profile."""
    from mpmworlds.builder.plan import write_plan

    rows = write_plan(named_profile(options), options.out)
    print(f"{options.out}: {len(rows)} scenes")
    return DONE


def add_splits(verbs: Any) -> None:
    """Add the verb `splits`."""
    parser = new_verb(
        verbs,
        splits,
        "record the split lists of a corpus, or check recorded ones",
        "mpmworlds splits --check --dir splits/recorded/tiny",
    )
    add_corpus_options(parser, store=False)
    parser.add_argument("--manifest", type=Path, help="its ids; planned anew if absent")
    parser.add_argument(
        "--dir", type=Path, help="recorded lists (default splits/recorded/CONFIG)"
    )
    parser.add_argument(
        "--check", action="store_true", help="recompute and compare, write nothing"
    )


def splits(options: argparse.Namespace) -> int:
    """Record or check the lists of a corpus."""
    from mpmworlds.builder.manifest import read_manifest
    from mpmworlds.builder.plan import sample_ids
    from mpmworlds.splits.assign import assign
    from mpmworlds.splits.manifest import check, write_lists

    profile = named_profile(options)
    folder = options.dir or Path("splits/recorded") / options.config
    if options.manifest:
        ids = [row.id for row in read_manifest(options.manifest)]
    else:
        ids = sample_ids(profile)
    if options.check:
        differences = check(folder, ids, profile.split)
        print("\n".join(differences) or f"{folder}: {len(ids)} ids, as computed")
        return DOES_NOT_HOLD if differences else DONE
    lists = assign(ids, profile.split)
    write_lists(folder, lists)
    print(f"{folder}: " + ", ".join(f"{k} {len(v)}" for k, v in lists.items()))
    return DONE


def add_materialise(verbs: Any) -> None:
    """Add the verb `materialise`."""
    parser = new_verb(
        verbs,
        materialise,
        "render the scenes of a manifest into the store, resumably",
        "mpmworlds materialise --manifest work/tiny/manifest.parquet",
    )
    add_corpus_options(parser, store=True)
    parser.add_argument("--manifest", type=Path, required=True, help="what to render")
    parser.add_argument(
        "--record", type=Path, help="write the hashes of all videos here (.jsonl)"
    )


def materialise(options: argparse.Namespace) -> int:
    """Render what the store lacks."""
    from mpmworlds.builder.manifest import read_manifest
    from mpmworlds.builder.materialise import write_record
    from mpmworlds.builder.store import Store

    rows, store = read_manifest(options.manifest), Store(options.store)
    done = _render(rows, store, options.workers)
    if options.record and not done.failures:
        write_record(options.record, rows, store)
    return DOES_NOT_HOLD if done.failures else DONE


def _render(rows: Any, store: Any, workers: int) -> Any:
    """Render what is missing and say what became of it."""
    from mpmworlds.builder.materialise import materialise as render

    done = render(rows, store, store.root / "failures.jsonl", workers)
    say(
        f"{store.root}: {done.rendered} rendered, {done.reused} there before, "
        f"{len(done.failures)} failed"
    )
    for failure in done.failures:
        say(f"{failure.id}: {failure.reason}")
    return done


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
    from mpmworlds.builder.manifest import read_manifest
    from mpmworlds.builder.plan import write_plan
    from mpmworlds.builder.release import build_release
    from mpmworlds.builder.store import Store

    params, store = read_params(options), Store(options.store)
    version = setting(params, "version", str)
    rows_per_shard = setting(params, "rows_per_shard", int)
    manifest = options.manifest or options.store / f"{options.config}.parquet"
    if not options.manifest:
        write_plan(named_profile(options), manifest)
    if _render(read_manifest(manifest), store, options.workers).failures:
        say(f"{options.out}: not built, because scenes failed")
        return DOES_NOT_HOLD
    shards = build_release(
        manifest,
        store,
        options.out,
        {options.config: None},
        version=version,
        rows_per_shard=rows_per_shard,
        workers=options.workers or 1,
    )
    print(f"{options.out}: {len(shards)} shards")
    return DONE
