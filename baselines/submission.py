"""Submissions: predictions in one folder, with a card and checksums, whole or refused.

SUBMISSION/card.yaml          what made them
SUBMISSION/predictions/...    see `baselines.predictions`
SUBMISSION/SHA256SUMS         of all of it
"""

import shutil
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Final, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mpmworlds.baselines.predictions import PredictionsError, prediction_files
from mpmworlds.files.checksums import (
    CHECKSUMS,
    files_below,
    read_checksums,
    sha256_of_file,
    write_checksums,
)
from mpmworlds.loaders.regimes import REGIMES

CARD: Final = "card.yaml"
PREDICTIONS: Final = "predictions"
NAMED_AT_MOST: Final = 3


class SubmissionError(ValueError):
    """A submission that is not whole or not well described."""


class Card(BaseModel):
    """What a submission says of itself."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    system: str = Field(min_length=1, description="name in tables")
    contact: str = Field(min_length=3, description="who answers questions")
    config: str = Field(description="configuration of the release")
    split: str = Field(description="split of the samples")
    regime: str = Field(description="what the system was told")
    kind: Literal["videos", "programs", "scenes"] = Field(description="of predictions")
    fps: float = Field(gt=0, description="frames per second that it works at")
    resolution: int = Field(gt=0, description="pixels along a side that it works at")
    candidates: int = Field(ge=1, description="N of best-of-N: per sample")
    cost: str = Field(min_length=1, description="of all of it: money, tokens or hours")
    hardware: str = Field(min_length=1, description="what it ran on")
    url: str = Field(default="", description="code, weights or paper")
    notes: str = Field(default="", description="anything else")


def read_card(path: Path) -> Card:
    """Read and validate a card.

    Raises
    ------
    SubmissionError
        If there is none, a field is missing, unknown or wrong; says which.
    """
    if not path.is_file():
        fields = "\n".join(
            f"{name}: ... # {field.description}"
            + (" (may be left out)" if not field.is_required() else "")
            for name, field in Card.model_fields.items()
        )
        raise SubmissionError(f"{path}: missing; write it, with\n{fields}")
    try:
        data: Any = yaml.safe_load(path.read_text("utf-8"))
        card = Card.model_validate(data)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise SubmissionError(f"{path}: is not YAML ({error})") from None
    except ValidationError as error:
        faults = "; ".join(
            f"{'.'.join(map(str, e['loc'])) or 'card'}: {e['msg']}"
            for e in error.errors()
        )
        raise SubmissionError(f"{path}: {faults}") from None
    if card.regime not in REGIMES:
        raise SubmissionError(
            f"{path}: regime {card.regime!r}: must be one of {list(REGIMES)}"
        )
    return card


def pack(
    predictions: Path,
    card: Path,
    out: Path,
    expected: Collection[str],
    *,
    partial: bool = False,
) -> list[str]:
    """Make a submission.

    Parameters
    ----------
    predictions
        Folder of predictions, see `prediction_files`.
    card
        The card.
    out
        Folder to make; there must be none.
    expected
        Ids of all samples that it must hold.
    partial
        Whether samples may be missing.

    Returns
    -------
    list of str
        What is worth knowing of it.

    Raises
    ------
    SubmissionError, PredictionsError
        If it would not pass `check`.
    """
    read_card(card)
    if out.exists():
        raise SubmissionError(f"{out}: is there already; remove it, or name another")
    draft = out.with_name(f".{out.name}.part")
    shutil.rmtree(draft, ignore_errors=True)
    for files in prediction_files(predictions).values():
        for path in files:
            place = draft / PREDICTIONS / path.relative_to(predictions)
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, place)
    shutil.copyfile(card, draft / CARD)
    write_checksums(draft)
    try:
        told = check(draft, expected, partial=partial)
    except ValueError:
        shutil.rmtree(draft)
        raise
    draft.rename(out)
    return told


def check(
    submission: Path, expected: Collection[str], *, partial: bool = False
) -> list[str]:
    """Check a submission.

    Parameters
    ----------
    submission
        Its folder.
    expected
        Ids of all samples that it must hold.
    partial
        Whether samples may be missing.

    Returns
    -------
    list of str
        What is worth knowing of it.

    Raises
    ------
    SubmissionError, PredictionsError
        If it is not whole, or a file is not what it should be.
    """
    card = read_card(submission / CARD)
    _check_sums(submission)
    found = prediction_files(submission / PREDICTIONS)
    unknown = sorted(found.keys() - set(expected))
    if unknown:
        raise SubmissionError(
            f"{_named(unknown)}: not among the {len(expected)} samples of "
            f"{card.config}/{card.split}"
        )
    missing = sorted(set(expected) - found.keys())
    if missing and not partial:
        raise SubmissionError(
            f"{len(missing)} of {len(expected)} samples have no prediction: "
            f"{_named(missing)}; predict them, or say that it is partial (--partial)"
        )
    _check_candidates(card, found)
    rest = f", {len(missing)} missing" if missing else ""
    return [f"{card.system}: {len(found)} samples of {len(expected)}{rest}"]


def _check_candidates(card: Card, found: Mapping[str, list[Path]]) -> None:
    suffixes = {"videos": (".mp4", ".npy"), "programs": (".py",), "scenes": (".yaml",)}
    for name, files in found.items():
        if len(files) != card.candidates:
            raise SubmissionError(
                f"{name}: {len(files)} candidates, the card says {card.candidates}; "
                "every sample has as many"
            )
        for path in files:
            if path.suffix not in suffixes[card.kind]:
                raise SubmissionError(f"{name}: {path.name}; the card says {card.kind}")
            if not path.stat().st_size:
                raise PredictionsError(f"{path}: is empty")


def _check_sums(submission: Path) -> None:
    sums = read_checksums(submission)
    there = set(files_below(submission))
    if there != sums.keys():
        odd = sorted(there ^ sums.keys())
        raise SubmissionError(f"{_named(odd)}: not as {CHECKSUMS} says; pack it again")
    for name, expected in sorted(sums.items()):
        if sha256_of_file(submission / name) != expected:
            raise SubmissionError(f"{name}: has changed; pack it again")


def _named(names: list[str]) -> str:
    more = len(names) - NAMED_AT_MOST
    rest = f" and {more} more" if more > 0 else ""
    return ", ".join(names[:NAMED_AT_MOST]) + rest
