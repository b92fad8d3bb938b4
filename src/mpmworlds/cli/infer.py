"""The verb that looks for the scene of a clip: infer."""

import argparse
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import DONE, new_verb


def add_infer(verbs: Any) -> None:
    """Add the verb `infer`."""
    parser = new_verb(
        verbs,
        infer,
        "find a scene that draws the first 2.5 s of a clip of flat colours",
        "mpmworlds infer clip.mp4 --out scene.yaml",
    )
    parser.add_argument("clip", type=Path, help="square video")
    parser.add_argument("--out", type=Path, required=True, help="scene file to write")
    parser.add_argument(
        "--side-info",
        type=Path,
        metavar="FILE",
        help="what is known of the scene: a scene file with gaps, or a caption",
    )
    parser.add_argument(
        "--runs", type=int, default=800, help="scenes to try (default 800)"
    )
    parser.add_argument(
        "--minutes",
        type=float,
        default=4.0,
        help="estimated minutes of one core that they take (default 4)",
    )
    parser.add_argument("--seed", type=int, default=0, help="which draws (default 0)")


def infer(options: argparse.Namespace) -> int:
    """Search, write the best scene, and say what is believed."""
    from tqdm import tqdm  # type: ignore[import-untyped]

    from mpmworlds.baselines.search.belief import believed
    from mpmworlds.baselines.search.infer import Budget
    from mpmworlds.baselines.search.infer import infer as search
    from mpmworlds.baselines.search.reading import read_clip
    from mpmworlds.baselines.search.side import read_side
    from mpmworlds.files.atomic import write_atomically
    from mpmworlds.files.targets import check_file
    from mpmworlds.files.text import read_text

    check_file(options.out)
    if options.runs < 1 or not options.minutes > 0:
        raise ValueError("--runs and --minutes: must be more than 0")
    told = read_side(read_text(options.side_info) if options.side_info else "")
    clip = read_clip(options.clip)
    with tqdm(total=100, desc="search", unit="%", bar_format="{l_bar}{bar}|") as bar:
        found = search(
            *clip,
            told,
            Budget(options.runs, options.minutes),
            1,
            options.seed,
            lambda share: bar.update(round(100 * share) - bar.n),
        )
    write_atomically(options.out, found.scenes[0].encode())
    print("\n".join(believed(found)))
    return DONE
