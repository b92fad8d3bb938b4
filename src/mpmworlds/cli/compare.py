"""The verb that compares two scenes: compare."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mpmworlds.cli.common import DONE, SCENE_FILE, new_verb

if TYPE_CHECKING:
    from mpmworlds.sim.scene.scene import Scene

FILES: Final = (".yaml", ".yml")


def add_compare(verbs: Any) -> None:
    """Add the verb `compare`."""
    parser = new_verb(
        verbs,
        compare,
        "print what differs between two scenes, thing by thing of a colour",
        "mpmworlds compare p0123 work/results/search-frames_only/scenes/p0123.yaml",
    )
    for name, what in (("truth", "the one"), ("found", "the other")):
        parser.add_argument(
            name,
            metavar=name.upper(),
            help=f"{what}: a scene file, or the id of a sample",
        )
    parser.add_argument(
        "--config", default="full", help="corpus that has the sample (default full)"
    )
    parser.add_argument("--json", action="store_true", help="print them as JSON")


def compare(options: argparse.Namespace) -> int:
    """Print a line for each field that differs."""
    from mpmworlds.baselines.search.differences import differences

    truth, found = (_scene(s, options.config) for s in (options.truth, options.found))
    there = list(differences(truth, found))
    if options.json:
        print(json.dumps([asdict(one) for one in there], indent=2))
    elif there:
        print("\n".join(map(str, there)))
    else:
        print("nothing differs")
    return DONE


def _scene(source: str, config: str) -> "Scene":
    """A scene of a file, or of a sample of the corpus."""
    from mpmworlds.builder.plan.lookup import recorded_rows
    from mpmworlds.files.text import read_text
    from mpmworlds.sim.scene.scene import Scene

    if Path(source).suffix in FILES:
        text = read_text(Path(source), f"{SCENE_FILE}, or the id of a sample")
        return Scene.from_yaml(text, source)
    return Scene.from_yaml(recorded_rows([source], config)[source]["scene"], source)
