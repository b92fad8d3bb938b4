"""The verb `propose`: new scenes by a language model."""

import argparse
import json
import sys
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    new_verb,
    parameters,
    read_text,
    say,
)

CANDIDATES_PER_SCENE = 10  # bounds a run whose candidates are all turned down


def add_propose(verbs: Any) -> None:
    """Add the verb `propose`."""
    parser = new_verb(
        verbs,
        propose,
        "propose scenes by a language model behind an OpenAI-compatible endpoint: "
        "address and key in OPENAI_BASE_URL and OPENAI_API_KEY",
        "mpmworlds propose --kind parents --count 20 --out proposals.jsonl --model M",
    )
    parser.add_argument("--kind", choices=("parents", "children"), required=True)
    parser.add_argument("--count", type=int, required=True, help="scenes to accept")
    parser.add_argument("--out", type=Path, required=True, help="proposals (.jsonl)")
    parser.add_argument(
        "--parent",
        action="append",
        help="scene to edit, for children: a file (.yaml), or the id of a seed or "
        "parent of the corpus; may be given again (default: seeds)",
    )
    parser.add_argument(
        "--manifest", type=Path, help="corpus of such ids (default: the recorded one)"
    )
    parser.add_argument(
        "--programs",
        action="store_true",
        help="ask for a program beside each scene, and run what the model writes to "
        "compare its first frame with the scene. Programs with other modules, files or "
        "hidden names are refused unrun, but that is no sandbox: with a model that you "
        "do not trust, work in a container",
    )
    parser.add_argument(
        "--screen",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="accept only what passes a short run, as in a plan (default); its "
        "findings are kept beside --out, .trials.jsonl",
    )
    parser.add_argument(
        "--rejections", type=Path, help="write what was turned down, and why (.jsonl)"
    )
    parser.add_argument(
        "--params", type=Path, help="another params.yaml: its root_seed"
    )
    parser.add_argument("--json", action="store_true", help="print the counts as JSON")
    _add_request_options(parser)


def _add_request_options(parser: Any) -> None:
    parser.add_argument("--model", help="default: MPMWORLDS_LLM_MODEL")
    parser.add_argument(
        "--n", type=int, default=4, help="candidates per request (default 4)"
    )
    parser.add_argument("--temperature", type=float, help="default: the server's own")
    parser.add_argument("--max-tokens", type=int, help="default: the server's own")
    parser.add_argument(
        "--transcript",
        type=Path,
        help="requests and replies; what is in it is not asked again (default: beside "
        "--out, .transcript.jsonl)",
    )
    parser.add_argument(
        "--max-requests",
        type=int,
        help=f"give up after so many (default: for {CANDIDATES_PER_SCENE} candidates "
        "per scene)",
    )
    parser.add_argument("--requests-per-minute", type=float, help="default: no limit")
    parser.add_argument(
        "--attempts", type=int, default=6, help="per request (default 6)"
    )
    parser.add_argument(
        "--timeout",
        type=float,
        default=300.0,
        help="longest silence of the server [s] (default 300)",
    )
    for way, what in (("in", "prompts"), ("out", "completions")):
        parser.add_argument(
            f"--price-{way}", type=float, help=f"of a million tokens of {what}"
        )


def propose(options: argparse.Namespace) -> int:
    """Ask until enough scenes are accepted, and write them."""
    from mpmworlds.builder.llm.transcript import Transcript

    requests, known = _requests(options)
    client = _client(options)
    path = options.transcript or options.out.with_suffix(".transcript.jsonl")
    with Transcript(path) as transcript:
        tally = _collect(options, requests, known, client, transcript)
    counts = tally.to_data()
    if options.price_in is not None:
        counts["price"] = round(tally.price(options.price_in, options.price_out), 6)
    print(json.dumps(counts) if options.json else _table(options.out, counts))
    if tally.accepted < options.count:
        say(
            f"{tally.accepted} of {options.count} scenes after {tally.requests} "
            "requests; raise --max-requests, or look at --rejections"
        )
        return DOES_NOT_HOLD
    return DONE


def _requests(options: argparse.Namespace) -> tuple[Any, list[Any]]:
    """The requests of a run, and the scenes that count as known."""
    from mpmworlds.builder.llm.endpoint import model_name
    from mpmworlds.builder.llm.request import Sampling, child_requests, parent_requests
    from mpmworlds.builder.seeds import load_seeds

    if options.count < 1:
        raise ValueError(f"--count {options.count}: must be at least 1")
    if options.max_requests is not None and options.max_requests < 1:
        raise ValueError(f"--max-requests {options.max_requests}: must be at least 1")
    if (options.price_in is None) != (options.price_out is None):
        raise ValueError("--price-in and --price-out: give both or none")
    if options.parent and options.kind == "parents":
        raise ValueError("--parent: only with --kind children; drop one of the two")
    if options.manifest and not options.parent:
        raise ValueError("--manifest: only with --parent ID; name a root, or drop it")
    how = Sampling(
        model_name(options.model),
        parameters(options).root_seed,
        options.n,
        options.programs,
        options.temperature,
        options.max_tokens,
    )
    seeds = load_seeds()
    if options.kind == "parents":
        requests = parent_requests(seeds, how)
        parents = seeds
    else:
        given = options.parent
        parents = _scenes(given, options.manifest) if given else seeds
        requests = child_requests(parents, how)
    known = [*seeds.values(), *parents.values()]
    return islice(requests, _most_requests(options)), known


def _most_requests(options: argparse.Namespace) -> int:
    most = -(-CANDIDATES_PER_SCENE * options.count // options.n)
    return int(options.max_requests or most)


def _scenes(names: list[str], manifest: Path | None) -> dict[str, Any]:
    """Scenes of files by the files' names, which must differ, and of roots by id."""
    from mpmworlds.sim.scene.scene import Scene

    roots = [name for name in names if _is_root(name)]
    scenes = _scenes_of_roots(roots, manifest) if roots else {}
    for path in (Path(name) for name in names if name not in roots):
        if path.stem in scenes:
            raise ValueError(
                f"--parent {path}: another parent is named {path.stem!r}; rename it"
            )
        scenes[path.stem] = Scene.from_yaml(read_text(path), str(path))
    return scenes


def _is_root(name: str) -> bool:
    """Whether a name is the id of a seed or parent."""
    from mpmworlds.splits.ids import SampleId, SampleIdError

    try:
        return SampleId.parse(name).family == name
    except SampleIdError:
        return False


def _scenes_of_roots(names: list[str], manifest: Path | None) -> dict[str, Any]:
    from mpmworlds.builder.plan.manifest import read_table, recorded_manifest
    from mpmworlds.sim.scene.scene import Scene

    path = manifest or recorded_manifest("full")
    columns = read_table(path, ["id", "scene"]).to_pydict()
    texts = dict(zip(columns["id"], columns["scene"], strict=True))
    if missing := [name for name in names if name not in texts]:
        raise LookupError(f"--parent {missing[0]}: is not in {path}")
    return {name: Scene.from_yaml(texts[name], name) for name in names}


def _client(options: argparse.Namespace) -> Any:
    from mpmworlds.builder.llm.client import Client
    from mpmworlds.builder.llm.endpoint import Endpoint, Patience

    patience = Patience(attempts=options.attempts, timeout=options.timeout)
    endpoint = Endpoint.from_environment()
    return Client(endpoint, patience, options.requests_per_minute)


def _collect(
    options: argparse.Namespace,
    requests: Any,
    known: list[Any],
    client: Any,
    transcript: Any,
) -> Any:
    """Gather proposals and write them, also those before a failure; returns counts."""
    from tqdm import tqdm  # type: ignore[import-untyped]

    from mpmworlds.builder.llm.agreement import disagreements
    from mpmworlds.builder.llm.proposals import Asker, Filter
    from mpmworlds.builder.llm.proposals import propose as proposals_of

    asker = Asker(client, transcript, most=options.max_requests)
    chosen = Filter(_acceptor(options), disagreements, asker.tally)
    chosen.know(known)
    proposals: list[Any] = []
    try:
        with tqdm(
            total=options.count, desc="propose", unit="scene", file=sys.stderr
        ) as bar:
            for proposal in proposals_of(requests, asker, chosen):
                proposals.append(proposal)
                bar.set_postfix(
                    requests=asker.tally.requests, rejected=asker.tally.rejected.total()
                )
                bar.update()
                if len(proposals) == options.count:
                    break
    finally:
        if proposals or not options.out.exists():  # else what is there is worth more
            _write(options.out, proposals)
        if options.rejections:
            _write(options.rejections, chosen.rejected)
    return asker.tally


def _acceptor(options: argparse.Namespace) -> Any:
    """What says why a valid scene is turned down."""
    from mpmworlds.builder.plan.families import Screen
    from mpmworlds.builder.plan.screen import fault
    from mpmworlds.builder.plan.trials import append_journal, read_journal

    if not options.screen:
        return lambda scene: None
    journal = options.out.with_suffix(".trials.jsonl")
    screen = Screen(read_journal(journal))

    def accept(scene: Any) -> str | None:
        reason = fault(screen.findings(scene))
        if screen.new:
            append_journal(journal, screen.new)
            screen.take()
        return reason

    return accept


def _write(path: Path, items: list[Any]) -> None:
    from mpmworlds.files.atomic import write_atomically

    lines = [json.dumps(asdict(item), sort_keys=True) + "\n" for item in items]
    write_atomically(path, "".join(lines).encode())


def _table(out: Path, counts: dict[str, Any]) -> str:
    """The counts, one line each, reasons indented."""
    lines = [f"{out}: {counts.pop('accepted')} scenes"]
    for name, value in counts.items():
        if isinstance(value, dict):
            lines += [f"{name}: {sum(value.values())}"]
            lines += [f"  {reason}: {number}" for reason, number in value.items()]
        else:
            lines.append(f"{name}: {value}")
    return "\n".join(lines)
