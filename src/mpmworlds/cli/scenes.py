"""Verbs about one scene or program: schema, link, run."""

import argparse
import json
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import DOES_NOT_HOLD, DONE, SCENE_FILE, new_verb, say
from mpmworlds.files.targets import check_file
from mpmworlds.files.text import read_text
from mpmworlds.sim.run.compilers import MODULES


def add_schema(verbs: Any) -> None:
    """Add the verb `schema`."""
    parser = new_verb(
        verbs,
        schema,
        "print the JSON Schema of a scene, or of what an evaluation writes",
        "mpmworlds schema > scene.schema.json",
    )
    parser.add_argument(
        "of",
        nargs="?",
        default="scene",
        choices=["scene", "results", "summary"],
        help="a scene file (default), a line of results.jsonl, or a summary.json",
    )


def schema(options: argparse.Namespace) -> int:
    """Print a JSON Schema."""
    if options.of == "scene":
        from mpmworlds.sim.scene.scene import json_schema
    else:
        from mpmworlds.baselines.schemas import SCHEMAS

        json_schema = SCHEMAS[options.of]
    print(json.dumps(json_schema(), indent=2))
    return DONE


def add_link(verbs: Any) -> None:
    """Add the verb `link`."""
    parser = new_verb(
        verbs,
        link,
        "write the standalone program of a scene",
        "mpmworlds link scene.yaml -o program.py",
    )
    parser.add_argument("scene", type=Path, help="scene file (YAML)")
    parser.add_argument("-o", "--out", type=Path, help="write here, not to stdout")


def link(options: argparse.Namespace) -> int:
    """Write the program of a scene."""
    from mpmworlds.files.atomic import write_atomically

    check_file(options.out)
    program = _program(options.scene)
    if options.out:
        write_atomically(options.out, program.encode())
    else:
        print(program, end="")
    return DONE


def _program(path: Path) -> str:
    """The program of a scene file."""
    from mpmworlds.sim.program.link import link as link_scene
    from mpmworlds.sim.scene.scene import Scene

    return link_scene(Scene.from_yaml(read_text(path, SCENE_FILE), str(path)))


def add_run(verbs: Any) -> None:
    """Add the verb `run`."""
    parser = new_verb(
        verbs,
        run,
        "run a scene or a program and write its exact video",
        "mpmworlds run scene.yaml --out video.mp4 --sheet sheet.png",
    )
    parser.add_argument("source", type=Path, help="scene (.yaml) or program (.py)")
    parser.add_argument("--out", type=Path, help="video to write (.mp4, lossless)")
    parser.add_argument("--sheet", type=Path, help="contact sheet to write (.png)")
    parser.add_argument(
        "--states",
        type=Path,
        help="states to write (.npz): positions and velocities of all particles, poses "
        "and rates of colliders and rigid bodies, mass, momentum and energy per frame",
    )
    parser.add_argument(
        "--states-dtype",
        choices=("float32", "float16"),
        default="float32",
        help="of positions and velocities in --states: exact, or half the size and "
        "positions within 0.25 mm (default float32)",
    )
    parser.add_argument(
        "--compiler",
        choices=MODULES,
        default="taichi",
        help="what runs the program: taichi, or a fork of it that is installed "
        "(default taichi)",
    )
    parser.add_argument("--frames", type=int, help="stop after so many frames")
    parser.add_argument(
        "--framerate", type=int, default=30, help="of a program's video (default 30)"
    )
    parser.add_argument(
        "--timeout", type=float, default=1800.0, help="seconds (default 1800)"
    )
    parser.add_argument(
        "--unsafe-no-sandbox",
        action="store_true",
        help="let a program.py do all that you may do: read and write your files, use "
        "the network; only for one that you trust",
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="print the outcome as JSON; with --states also mass, momentum and energy "
        "at the start and at the end",
    )


def run(options: argparse.Namespace) -> int:
    """Run a program and write what was asked for."""
    from mpmworlds.files.atomic import write_atomically
    from mpmworlds.sim.program.link import link as link_scene
    from mpmworlds.sim.run.encode import encode_mp4, frames_sha256
    from mpmworlds.sim.run.run import run as run_program
    from mpmworlds.sim.run.states import States, save_states, summary
    from mpmworlds.sim.scene.scene import Scene

    for name, value in (("frames", options.frames), ("framerate", options.framerate)):
        if value is not None and value < 1:
            raise ValueError(f"--{name} {value}: must be at least 1")
    if not options.timeout > 0:
        raise ValueError(f"--timeout {options.timeout}: must be more than 0")
    for path in (options.out, options.sheet, options.states):
        check_file(path)
    framerate, scene = options.framerate, None
    if options.source.suffix == ".py":
        program = read_text(options.source, "a program (.py)")
    else:
        text = read_text(options.source, f"{SCENE_FILE}, or a program (.py)")
        scene = Scene.from_yaml(text, str(options.source))
        program, framerate = link_scene(scene), scene.output.framerate
    outcome = run_program(
        program,
        options.frames,
        options.timeout,
        states=options.states is not None,
        compiler=options.compiler,
        trusted=scene is not None or options.unsafe_no_sandbox,
    )
    result: dict[str, Any] = {
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
        if outcome.states:
            states = States.of(scene, outcome.states) if scene else outcome.states
            save_states(options.states, states, options.states_dtype)
            if isinstance(states, States):
                result["invariants"] = summary(states)
    if options.json:
        print(json.dumps(result))
    else:
        print(f"{result['status']}: {result['frames']} frames, {result['seconds']} s")
        if outcome.message:
            say(outcome.message)
    return DONE if outcome.status == "ok" else DOES_NOT_HOLD


def _png(frames: Any) -> bytes:
    import cv2

    from mpmworlds.sim.run.sheet import contact_sheet

    sheet = cv2.cvtColor(contact_sheet(frames), cv2.COLOR_RGB2BGR)
    return bytes(cv2.imencode(".png", sheet)[1])
