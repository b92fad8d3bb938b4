"""The evaluation loop: predictor x samples -> results, summary, table."""

import json
import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.baselines.candidates import SELECTIONS
from mpmworlds.baselines.protocol import AnyPredictor
from mpmworlds.baselines.provenance import NO_OPTIONS, Provenance
from mpmworlds.baselines.registry import predictor_named
from mpmworlds.baselines.results import (
    CLIPS,
    RESULTS,
    SCENES,
    SUMMARY,
    ResultsFile,
)
from mpmworlds.baselines.scoring import (
    HOW,
    Found,
    How,
    Scoring,
    Trouble,
    scored_or_trouble,
)
from mpmworlds.baselines.selfcheck import check_sandbox, self_check
from mpmworlds.baselines.summary import summarise_results, summary_table
from mpmworlds.builder.render.executors import carry_out_all, open_executor
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.targets import check_folder
from mpmworlds.loaders.load import Example, Examples, load
from mpmworlds.loaders.regimes import DEFAULT

log = logging.getLogger(__name__)

TABLE: Final = "summary.txt"
PAUSE: Final = 5.0  # seconds before what failed is tried again; longer each time

ScoreAll = Callable[[Sequence[str]], Iterator[tuple[str, Found | Trouble]]]


def evaluate(
    release_dir: Path | str,
    predictor_name: str,
    split: str,
    out_dir: Path | str,
    config: str = "tiny",
    limit: int | None = None,
    progress: bool = True,
    regime: str = DEFAULT,
    *,
    options: Mapping[str, Any] = NO_OPTIONS,
    ids: Sequence[str] | None = None,
    how: How = HOW,
    retries: int = 1,
    workers: int = 0,
    ray: str | None = None,
) -> Path:
    """Evaluate a predictor on a split of a release.

    Parameters
    ----------
    release_dir
        Folder of the release, with its SHA256SUMS.
    predictor_name
        A key of `registry.PREDICTORS`, or ``module:Class``.
    split
        Split to evaluate on.
    out_dir
        Folder of the results. An evaluation that was stopped goes on from what is
        there; samples that are done are not computed again.
    config
        Configuration of the release.
    limit
        Evaluate only so many samples, the first ones of the split.
    progress
        Show a progress bar on standard error.
    regime
        What the predictor is told besides the prefix, a key of
        `mpmworlds.loaders.regimes.REGIMES`.
    options
        What the predictor is made with.
    ids
        Evaluate only these samples; all if None.
    how
        How candidates are chosen and run.
    retries
        How often to go over the samples again of which nothing could be said, because
        a server, a network or a machine failed.
    workers
        Number of processes, 0 for as many as there are cores; 1 for a predictor that
        has a GPU for itself (one that says so by ``exclusive = True`` gets 1).
    ray
        Address of a Ray cluster, see `mpmworlds.builder.render.executors`.

    Returns
    -------
    Path
        The summary, ``summary.json``. Beside it lie ``results.jsonl`` and
        ``summary.txt``, the table.

    Raises
    ------
    ResultsError
        If ``out_dir`` holds results of another predictor, release, split or version.
    OSError
        If ``out_dir`` cannot be written to.
    ValueError
        If the predictor, the regime, a sample or the split is unknown, there is no
        sample, or a number is too small.
    SelfCheckError
        If this machine does not give the scores that it must.
    """
    if limit is not None and limit < 1:
        raise ValueError(
            f"limit = {limit}, must be at least 1, or None for all samples"
        )
    if how.selection not in SELECTIONS:
        raise ValueError(
            f"selection {how.selection!r}: unknown, must be one of {list(SELECTIONS)}"
        )
    _check_retries(retries)
    check_folder(Path(out_dir))
    release = Path(release_dir)
    predictor = predictor_named(predictor_name, options)
    _check_regime(predictor, regime)
    examples = load(release, split=split, config=config, regime=regime)
    examples = _chosen(examples, ids)[:limit]
    provenance = Provenance.of(
        release,
        predictor,
        config,
        split,
        regime,
        options=options,
        selection=how.selection,
    )
    if len(examples):
        self_check(examples[0], sandbox=how.sandbox)
    here = ray is None and (workers == 1 or getattr(predictor, "exclusive", False))
    if here:
        return evaluate_examples(
            examples, predictor, provenance, Path(out_dir), progress, how, retries
        )
    names = list(examples.table["id"])
    number = {name: k for k, name in enumerate(names)}
    scoring = Scoring(predictor_name, dict(options), regime, how)
    with closing(open_executor(scoring, workers, ray)) as executor:

        def score_all(pending: Sequence[str]) -> Iterator[tuple[str, Found | Trouble]]:
            rows = (examples.table[number[name]] for name in pending)
            done = carry_out_all(executor, rows, lambda row: str(row["id"]))
            return ((str(row["id"]), found) for row, found in done)

        return _evaluate(
            names, score_all, provenance, Path(out_dir), progress, how, retries
        )


def _check_retries(retries: int) -> None:
    if retries < 0:
        raise ValueError(
            f"retries = {retries} (--retry-failed), must be at least 0: how often to "
            "go over samples again of which nothing could be said"
        )


def _check_regime(predictor: AnyPredictor, regime: str) -> None:
    """Raise if a predictor that needs to be told something is told something else."""
    suited = getattr(predictor, "regimes", (regime,))
    if regime not in suited:
        raise ValueError(
            f"predictor {predictor.name!r}: regime {regime!r} tells it too little or "
            f"too much, must be one of {list(suited)}"
        )


def _chosen(examples: Examples, ids: Sequence[str] | None) -> Examples:
    """Those of some ids, in the order of the release."""
    if ids is None:
        return examples
    there = {name: k for k, name in enumerate(examples.table["id"])}
    missing = [name for name in ids if name not in there]
    if missing:
        raise ValueError(
            f"{missing[0]}: not in this split of the configuration"
            + (f", like {len(missing) - 1} more" if missing[1:] else "")
        )
    rows = sorted({there[name] for name in ids})
    chosen = examples.table.select(rows)
    return Examples(chosen, examples.regime.name, examples.of)


def evaluate_examples(
    examples: Sequence[Example],
    predictor: AnyPredictor,
    provenance: Provenance,
    out_dir: Path,
    progress: bool = True,
    how: How = HOW,
    retries: int = 1,
) -> Path:
    """Evaluate any predictor on any examples, here; see `evaluate`.

    Parameters
    ----------
    examples
        Examples to predict, with their continuations.
    predictor
        What predicts them.
    provenance
        What the results have in common.
    out_dir
        Folder of the results.
    progress, how, retries
        As of `evaluate`.

    Returns
    -------
    Path
        The summary.
    """
    _check_retries(retries)
    check_folder(out_dir)
    names = _names(examples)
    number = {name: k for k, name in enumerate(names)}

    def score_all(pending: Sequence[str]) -> Iterator[tuple[str, Found | Trouble]]:
        for name in pending:
            yield name, scored_or_trouble(examples[number[name]], predictor, how)

    return _evaluate(names, score_all, provenance, out_dir, progress, how, retries)


def _names(examples: Sequence[Example]) -> list[str]:
    """Ids of examples, without decoding them where they have a table."""
    if isinstance(examples, Examples):
        return list(examples.table["id"])
    return [example.id for example in examples]


def _evaluate(
    names: Sequence[str],
    score_all: ScoreAll,
    provenance: Provenance,
    out_dir: Path,
    progress: bool,
    how: How,
    retries: int,
) -> Path:
    out_dir.mkdir(parents=True, exist_ok=True)
    if not names:
        raise ValueError(
            f"evaluation of {provenance.predictor!r} on {provenance.config}/"
            f"{provenance.split}: no sample to evaluate, must be at least one"
        )
    with (
        ResultsFile(out_dir / RESULTS, provenance) as file,
        tqdm(
            total=len(names),
            desc=f"{provenance.predictor}, {provenance.regime}",
            unit="sample",
            disable=not progress,
        ) as bar,
    ):
        pending = [name for name in names if file.get(name) is None]
        bar.update(len(names) - len(pending))
        troubles: dict[str, str] = {}
        for attempt in range(1 + retries):
            if attempt:
                log.warning("%s; once more in a moment", _said(troubles))
                time.sleep(PAUSE * attempt)
            troubles = _pass_over(score_all, pending, file, out_dir, bar, how)
            pending = [name for name in pending if name in troubles]
            if not pending:
                break
        file.put_in_order(names)
        results = [r for name in names for r in file.get(name) or ()]
    summary = summarise_results(provenance, results, len(names), troubles)
    path = out_dir / SUMMARY
    text = json.dumps(summary, indent=2, allow_nan=False) + "\n"
    write_atomically(out_dir / TABLE, summary_table(summary).encode())
    write_atomically(path, text.encode())
    return path


def _pass_over(
    score_all: ScoreAll,
    pending: Sequence[str],
    file: ResultsFile,
    out_dir: Path,
    bar: Any,
    how: How,
) -> dict[str, str]:
    """Score samples; returns why nothing can be said of some of them."""
    troubles = {}
    for name, found in score_all(pending):
        if isinstance(found, Trouble):
            troubles[name] = found.reason
            if found.sandbox and how.sandbox:
                check_sandbox()
        else:
            if found.clip is not None:
                (out_dir / CLIPS).mkdir(exist_ok=True)
                write_atomically(out_dir / CLIPS / f"{name}.mp4", found.clip)
            if found.scene:
                (out_dir / SCENES).mkdir(exist_ok=True)
                path = out_dir / SCENES / f"{name}.yaml"
                write_atomically(path, found.scene.encode())
            file.append(found.results)
            bar.update()
        bar.set_postfix(troubled=len(troubles), refresh=False)
    return troubles


def _said(troubles: Mapping[str, str]) -> str:
    name, reason = next(iter(troubles.items()))
    more = f" and {len(troubles) - 1} more" if troubles.keys() - {name} else ""
    return f"nothing can be said of {name}{more}: {reason}"
