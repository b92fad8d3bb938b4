"""The command `mpmworlds`: each verb is one thin function over the library.

Exit status: 0 done; 1 what was asked about does not hold, or a program failed; 2 wrong
use or wrong input. Results go to standard output, progress and messages to standard
error.
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import mpmworlds

DONE, DOES_NOT_HOLD, WRONG_USE = 0, 1, 2
STORE = Path("work/store")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns the exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    verb: Callable[[argparse.Namespace], int] = options.verb
    try:
        return verb(options)
    except (OSError, ValueError, LookupError, RuntimeError) as error:
        print(f"mpmworlds {options.name}: {_text(error)}", file=sys.stderr)
        return WRONG_USE
    except KeyboardInterrupt:
        print(
            f"mpmworlds {options.name}: interrupted; run it again to go on",
            file=sys.stderr,
        )
        return 130


def _text(error: BaseException) -> str:
    if isinstance(error, KeyError) and error.args:
        return str(error.args[0])
    return str(error) or type(error).__name__


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="mpmworlds",
        description="2D Material Point Method worlds as programs, scenes and videos.",
        epilog="`mpmworlds VERB --help` explains a verb and shows an example.",
    )
    parser.add_argument("--version", action="version", version=mpmworlds.__version__)
    verbs = parser.add_subparsers(required=True, metavar="VERB", dest="name")
    for add in (
        _add_schema,
        _add_link,
        _add_run,
        _add_plan,
        _add_splits,
        _add_materialise,
        _add_build,
        _add_verify,
        _add_evaluate,
    ):
        add(verbs)
    return parser


def _verb(verbs: Any, run: Callable[..., int], what: str, example: str) -> Any:
    parser = verbs.add_parser(
        run.__name__,
        help=what,
        description=f"{what[0].upper()}{what[1:]}.",
        epilog=f"example: {example}",
    )
    parser.set_defaults(verb=run)
    return parser


def _say(message: str) -> None:
    print(message, file=sys.stderr)


def _read(path: Any) -> str:
    """Text of a file."""
    try:
        return str(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is not UTF-8 text ({error.reason})") from None


def _params(options: argparse.Namespace) -> dict[str, Any]:
    import yaml

    path = options.params or files("mpmworlds").joinpath("params.yaml")
    try:
        data = yaml.safe_load(_read(path))
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: is not YAML ({error})") from None
    if not isinstance(data, dict):
        raise ValueError(f"{path}: must be a mapping with the key 'profiles'")
    return data


def _setting(params: dict[str, Any], name: str, kind: type) -> Any:
    """A value at the top of params.yaml."""
    value = params.get(name)
    if not isinstance(value, kind):
        raise ValueError(f"params.yaml: {name} = {value!r}, must be of type {kind.__name__}")
    return value


def _profile(options: argparse.Namespace) -> Any:
    from mpmworlds.builder.plan import Profile

    return Profile.from_params(_params(options), options.config)


# ---- scenes and programs


def _add_schema(verbs: Any) -> None:
    _verb(
        verbs,
        schema,
        "print the JSON Schema of a scene, for editors and other tools",
        "mpmworlds schema > scene.schema.json",
    )


def schema(options: argparse.Namespace) -> int:
    """Print the JSON Schema of a scene."""
    from mpmworlds.sim.scene import json_schema

    print(json.dumps(json_schema(), indent=2))
    return DONE


def _add_link(verbs: Any) -> None:
    parser = _verb(
        verbs,
        link,
        "write the standalone program of a scene",
        "mpmworlds link scene.yaml -o program.py",
    )
    parser.add_argument("scene", type=Path, help="scene file (YAML)")
    parser.add_argument("-o", "--out", type=Path, help="write here, not to stdout")


def link(options: argparse.Namespace) -> int:
    """Write the program of a scene."""
    from mpmworlds.splits.atomic import write_atomically

    program = _program(options.scene)
    if options.out:
        write_atomically(options.out, program.encode())
    else:
        print(program, end="")
    return DONE


def _program(path: Path) -> str:
    """The program of a scene file."""
    from mpmworlds.sim.link import link as link_scene
    from mpmworlds.sim.scene import Scene

    return link_scene(Scene.from_yaml(_read(path), str(path)))


def _add_run(verbs: Any) -> None:
    parser = _verb(
        verbs,
        run,
        "run a scene or a program and write its exact video",
        "mpmworlds run scene.yaml --out video.mp4 --sheet sheet.png",
    )
    parser.add_argument("source", type=Path, help="scene (.yaml) or program (.py)")
    parser.add_argument("--out", type=Path, help="video to write (.mp4, lossless)")
    parser.add_argument("--sheet", type=Path, help="contact sheet to write (.png)")
    parser.add_argument("--frames", type=int, help="stop after so many frames")
    parser.add_argument(
        "--framerate", type=int, default=30, help="of a program's video (default 30)"
    )
    parser.add_argument(
        "--timeout", type=float, default=1800.0, help="seconds (default 1800)"
    )
    parser.add_argument("--json", action="store_true", help="print the outcome as JSON")


def run(options: argparse.Namespace) -> int:
    """Run a program and write what was asked for."""
    from mpmworlds.sim.encode import encode_mp4, frames_sha256
    from mpmworlds.sim.link import read_scene
    from mpmworlds.sim.run import run as run_program
    from mpmworlds.splits.atomic import write_atomically

    for name, value in (("frames", options.frames), ("framerate", options.framerate)):
        if value is not None and value < 1:
            raise ValueError(f"--{name} {value}: must be at least 1")
    if not options.timeout > 0:
        raise ValueError(f"--timeout {options.timeout}: must be more than 0")
    framerate = options.framerate
    if options.source.suffix == ".py":
        program = _read(options.source)
    else:
        program = _program(options.source)
        framerate = read_scene(program).output.framerate
    outcome = run_program(program, options.frames, options.timeout)
    result = {
        "status": outcome.status,
        "frames": len(outcome.frames),
        "seconds": round(outcome.seconds, 2),
        "message": outcome.message,
    }
    if outcome.status == "ok":
        result["frames_sha256"] = frames_sha256(outcome.frames)
        if options.out:
            write_atomically(options.out, encode_mp4(outcome.frames, framerate))
        if options.sheet:
            write_atomically(options.sheet, _png(outcome.frames))
    if options.json:
        print(json.dumps(result))
    else:
        print(f"{result['status']}: {result['frames']} frames, {result['seconds']} s")
        if outcome.message:
            _say(outcome.message)
    return DONE if outcome.status == "ok" else DOES_NOT_HOLD


def _png(frames: Any) -> bytes:
    import cv2

    from mpmworlds.sim.sheet import contact_sheet

    sheet = cv2.cvtColor(contact_sheet(frames), cv2.COLOR_RGB2BGR)
    return bytes(cv2.imencode(".png", sheet)[1])


# ---- the corpus


def _add_corpus_options(parser: Any, *, store: bool) -> None:
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


def _add_plan(verbs: Any) -> None:
    parser = _verb(
        verbs,
        plan,
        "plan a corpus: write the manifest of all its scenes",
        "mpmworlds plan --config tiny --out work/tiny/manifest.parquet",
    )
    _add_corpus_options(parser, store=False)
    parser.add_argument("--out", type=Path, required=True, help="manifest to write")


def plan(options: argparse.Namespace) -> int:
    """Write the manifest of a profile."""
    from mpmworlds.builder.plan import write_plan

    rows = write_plan(_profile(options), options.out)
    print(f"{options.out}: {len(rows)} scenes")
    return DONE


def _add_splits(verbs: Any) -> None:
    parser = _verb(
        verbs,
        splits,
        "record the split lists of a corpus, or check recorded ones",
        "mpmworlds splits --check --dir splits/recorded/tiny",
    )
    _add_corpus_options(parser, store=False)
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

    profile = _profile(options)
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


def _add_materialise(verbs: Any) -> None:
    parser = _verb(
        verbs,
        materialise,
        "render the scenes of a manifest into the store, resumably",
        "mpmworlds materialise --manifest work/tiny/manifest.parquet",
    )
    _add_corpus_options(parser, store=True)
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
    _say(
        f"{store.root}: {done.rendered} rendered, {done.reused} there before, "
        f"{len(done.failures)} failed"
    )
    for failure in done.failures:
        _say(f"{failure.id}: {failure.reason}")
    return done


def _add_build(verbs: Any) -> None:
    parser = _verb(
        verbs,
        build,
        "build a release: plan, render what is missing, write the shards",
        "mpmworlds build --config tiny --out release/mpmworlds",
    )
    _add_corpus_options(parser, store=True)
    parser.add_argument("--manifest", type=Path, help="build from this plan")
    parser.add_argument("--out", type=Path, required=True, help="folder of the release")


def build(options: argparse.Namespace) -> int:
    """Build a release folder."""
    from mpmworlds.builder.manifest import read_manifest
    from mpmworlds.builder.plan import write_plan
    from mpmworlds.builder.release import build_release
    from mpmworlds.builder.store import Store

    params, store = _params(options), Store(options.store)
    version = _setting(params, "version", str)
    rows_per_shard = _setting(params, "rows_per_shard", int)
    manifest = options.manifest or options.store / f"{options.config}.parquet"
    if not options.manifest:
        write_plan(_profile(options), manifest)
    if _render(read_manifest(manifest), store, options.workers).failures:
        _say(f"{options.out}: not built, because scenes failed")
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


def _add_verify(verbs: Any) -> None:
    parser = _verb(
        verbs,
        verify,
        "verify a release: hashes, rows, videos, and sampled re-simulation",
        "mpmworlds verify release/mpmworlds --resimulate 2",
    )
    parser.add_argument("release", type=Path, help="folder of the release")
    parser.add_argument(
        "--resimulate", type=int, default=1, help="samples to run again (default 1)"
    )
    parser.add_argument("--workers", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--json", action="store_true", help="print findings as JSON")


def verify(options: argparse.Namespace) -> int:
    """Look for anything wrong in a release."""
    from mpmworlds.builder.verify import verify_release

    findings = verify_release(options.release, options.resimulate, options.workers)
    if options.json:
        print(json.dumps({"release": str(options.release), "findings": findings}))
    else:
        print("\n".join(findings) or f"{options.release}: intact")
    return DOES_NOT_HOLD if findings else DONE


# ---- evaluation


def _add_evaluate(verbs: Any) -> None:
    parser = _verb(
        verbs,
        evaluate,
        "evaluate a predictor on a split of a release",
        "mpmworlds evaluate --predictor copy_last --release release/mpmworlds",
    )
    parser.add_argument("--release", type=Path, default=Path("release/mpmworlds"))
    parser.add_argument("--config", default="tiny", help="configuration (default tiny)")
    parser.add_argument("--predictor", required=True, help="name of a predictor")
    parser.add_argument("--split", default="test", help="split (default test)")
    parser.add_argument("--out", type=Path, help="default: work/results/PREDICTOR")
    parser.add_argument("--limit", type=int, help="evaluate only so many samples")
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")


def evaluate(options: argparse.Namespace) -> int:
    """Score a predictor and print the table."""
    from mpmworlds.baselines.evaluate import evaluate as run_evaluation
    from mpmworlds.baselines.summary import summary_table

    out = options.out or Path("work/results") / options.predictor
    path = run_evaluation(
        options.release,
        options.predictor,
        options.split,
        out,
        options.config,
        options.limit,
    )
    summary = json.loads(path.read_text("utf-8"))
    print(json.dumps(summary) if options.json else summary_table(summary))
    return DONE
