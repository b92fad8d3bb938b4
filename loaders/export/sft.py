"""Chats for supervised finetuning: pictures and a prompt, and the program as answer."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.clips import Stills, clip_of, sampled
from mpmworlds.loaders.export.folder import (
    Record,
    Source,
    place_of,
    write_export,
)
from mpmworlds.loaders.load import Examples, neutral_name, side_info_of
from mpmworlds.loaders.prompts import (
    PICTURES,
    PROMPT_VERSION,
    Prompt,
    VideoForm,
    answer_of,
    as_place,
    make_prompt,
    png_of,
)
from mpmworlds.loaders.regimes import Regime
from mpmworlds.loaders.scaffold import SCAFFOLD_VERSION
from mpmworlds.loaders.weights import weights_by_kind

FOLDER: Final = "images"


def export_sft(
    source: Source,
    out_dir: Path,
    *,
    task: str = "program",
    pictures: int = PICTURES,
    schema: bool = False,
    limit: int | None = None,
    workers: int = 1,
) -> int:
    """Write chats in the form that TRL and most finetuning scripts take.

    ``SPLIT.jsonl`` has a line for each sample: `messages`, whose contents are texts and
    places of pictures; `images`, the pictures in their order, paths below the folder;
    `weight`, how often it is to be seen; and `sample`, its id, which no message has.

    Parameters
    ----------
    source
        The samples, and their regime.
    out_dir
        Folder to write, or to go on with.
    task
        What the answer is: ``program`` or ``scene``.
    pictures
        Number of frames of the prefix that are shown, at least 2.
    schema
        Whether the JSON Schema is told with the task ``scene``.
    limit
        Only so many samples, the first ones.
    workers
        Number of processes, 0 for one per core.

    Returns
    -------
    int
        Number of samples.

    Raises
    ------
    ValueError
        If a setting is impossible, or the folder holds another export.
    """
    settings: Record = {
        "form": "sft",
        "task": task,
        "pictures": pictures,
        "schema": schema,
        "prompt": PROMPT_VERSION,
        "scaffold": SCAFFOLD_VERSION,
    }
    write = partial(_write, task=task, pictures=pictures, schema=schema)
    return write_export(
        source,
        settings,
        out_dir,
        f"{source.split}.jsonl",
        write,
        limit=limit,
        workers=workers,
    )


def question_about(
    row: Mapping[str, Any],
    stills: Stills,
    regime: Regime,
    task: str = "program",
    *,
    schema: bool = False,
) -> Prompt:
    """What a model in training is asked about a row of a release; see `make_prompt`."""
    told = side_info_of(row, regime)
    form = VideoForm.of_row(row)
    return make_prompt(stills, regime, told, form, task, schema=schema)


def _write(
    examples: Examples,
    index: int,
    folder: Path,
    *,
    task: str,
    pictures: int,
    schema: bool,
) -> Record:
    row = examples.table[index]
    stills = sampled(clip_of(row, prefix_only=True), pictures)
    prompt = question_about(row, stills, examples.regime, task, schema=schema)
    places = []
    for number, picture in enumerate(prompt.pictures):
        name = place_of(neutral_name(row["id"]), f"-{number:02d}.png")
        places.append(f"{FOLDER}/{name}")
        write_atomically(folder / places[-1], png_of(picture.frame))
    answer = [{"type": "text", "text": answer_of(row, task)}]
    return {
        "sample": row["id"],
        "weight": weights_by_kind()[row["kind"]],
        "images": places,
        "messages": [
            *prompt.messages(as_place),
            {"role": "assistant", "content": answer},
        ],
    }
