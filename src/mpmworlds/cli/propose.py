"""The verb `propose`: new scenes by a language model."""

import argparse
import json
from itertools import islice
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    new_verb,
    parameters,
    say,
)


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
        "hidden names are refused unrun; the others run in a sandbox",
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
    parser.add_argument(
        "--structured",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="ask the server to keep the model to the schema of scenes, if it can "
        "(default); not with --programs",
    )
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
        help="give up after so many (default: for 10 candidates per scene)",
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
    _check(options)
    requests, known = _requests(options)
    client = _client(options)  # which says what to install, if need be

    from mpmworlds.builder.llm.collect import collect, most_requests
    from mpmworlds.builder.llm.transcript import Transcript

    path = options.transcript or options.out.with_suffix(".transcript.jsonl")
    with Transcript(path) as transcript:
        bound = options.max_requests or most_requests(options.count, options.n)
        tally = collect(
            islice(requests, bound),
            known,
            client,
            transcript,
            options.out,
            count=options.count,
            most=options.max_requests,
            screen=options.screen,
            rejections=options.rejections,
        )
    return _tell(options, tally)


def _check(options: argparse.Namespace) -> None:
    """Refuse options that do not go together."""
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


def _requests(options: argparse.Namespace) -> tuple[Any, list[Any]]:
    """The requests of a run, and the scenes that count as known."""
    from mpmworlds.builder.llm.endpoint import model_name
    from mpmworlds.builder.llm.parents import read_parents
    from mpmworlds.builder.llm.request import Sampling, child_requests, parent_requests
    from mpmworlds.builder.seeds import load_seeds

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
        return parent_requests(seeds, how), list(seeds.values())
    parents = read_parents(options.parent, options.manifest) if options.parent else {}
    known = [*seeds.values(), *parents.values()]
    return child_requests(parents or seeds, how), known


def _client(options: argparse.Namespace) -> Any:
    from mpmworlds.builder.llm.client import Client
    from mpmworlds.builder.llm.endpoint import Endpoint, Patience
    from mpmworlds.builder.llm.structured import response_format

    structured = options.structured and not options.programs
    return Client(
        Endpoint.from_environment(),
        Patience(attempts=options.attempts, timeout=options.timeout),
        options.requests_per_minute,
        response_format() if structured else None,
    )


def _tell(options: argparse.Namespace, tally: Any) -> int:
    """Say what a run came to, and whether it is enough."""
    counts = tally.to_data()
    if options.price_in is not None:
        counts["price"] = round(tally.price(options.price_in, options.price_out), 6)
    print(json.dumps(counts) if options.json else _table(options.out, counts))
    if tally.accepted >= options.count:
        return DONE
    say(
        f"{tally.accepted} of {options.count} scenes after {tally.requests} "
        "requests; raise --max-requests, or look at --rejections"
    )
    return DOES_NOT_HOLD


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
