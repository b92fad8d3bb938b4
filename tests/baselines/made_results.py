"""Made-up results of made-up systems, written as an evaluation writes them."""

import hashlib
import json
from dataclasses import replace

from mpmworlds.baselines.provenance import Provenance
from mpmworlds.baselines.results import Result, ResultsFile
from mpmworlds.builder.release.layout import ConfigRecord, Record
from mpmworlds.metrics import SCORED, VERSION, definition

PROVENANCE = Provenance(
    predictor="copy_last",
    options={},
    predictor_sha256="c0",
    config="tiny",
    split="test",
    regime="frames_only",
    selection="prefix",
    knows_answers=False,
    release_sha256="5c86b8a17028ab81",
    metrics_version=VERSION,
    constants_sha256=hashlib.sha256(
        json.dumps(definition(), sort_keys=True).encode()
    ).hexdigest(),
    versions={"mpmworlds": "0.1.0"},
)
CEILING = 0.9375  # goodness of a re-simulation


def scores_of(goodness):
    """Scores of all metrics that are `goodness` from their worst to their best."""
    return {
        name: metric.worst + goodness * (metric.best - metric.worst)
        for name, metric in SCORED.items()
    }


def result(sample_id, goodness, *, prefix=None, ceiling=CEILING, **changes):
    """A candidate as good as told; a failure where `goodness` is None."""
    valid = goodness is not None
    fields = {
        "sample_id": sample_id,
        "family_id": sample_id[:5],
        "materials": ["liquid"],
        "object_types": ["dynamic_body"],
        "num_objects": 2,
        "motion": 0.25,
        "ceiling": None if ceiling is None else scores_of(ceiling),
        "candidate": 0,
        "candidates": 1,
        "outcome": "ok" if valid else "timeout",
        "reason": "" if valid else "60 s",
        "continuation": scores_of(goodness) if valid else None,
        "prefix": None if prefix is None else scores_of(prefix),
        "curves": curves_of(goodness) if valid else None,
        "processor": "one of ours",
    }
    return Result(**fields | changes)


def curves_of(goodness, frames=112):
    """Curves that fall from best to what the scores are, and reach it at the end."""
    return {
        name: [
            round(metric.best + (value - metric.best) * (k + 1) / frames, 6)
            for k in range(frames - (name in ("wmae", "anomaly", "anomaly_excess")))
        ]
        for (name, metric), value in zip(
            SCORED.items(), scores_of(goodness).values(), strict=True
        )
    }


def write(folder, samples, **changes):
    """Write the folder of an evaluation; returns it.

    `samples` are lists of the candidates of each sample, `changes` of the provenance.
    """
    told = {"predictor_sha256": changes.get("predictor", "copy_last")} | changes
    folder.mkdir(parents=True)
    with ResultsFile(folder / "results.jsonl", replace(PROVENANCE, **told)) as file:
        for candidates in samples:
            file.append(candidates)
    summarise(folder, len(samples))
    return folder


def summarise(folder, samples, expected=None, troubles=None):
    """Write what a report reads of the summary of an evaluation."""
    summary = {
        "samples": samples,
        "expected": expected or samples,
        "troubles": troubles or {},
    }
    (folder / "summary.json").write_text(json.dumps(summary))


def made_record(config):
    """Record of a release that has one configuration, without rows."""
    made = ConfigRecord(corpus="full", key="0", files=[])
    return Record(
        version="1.0.0",
        renderer="none",
        default=config,
        corpora={"full": "0"},
        configs={config: made},
    )
