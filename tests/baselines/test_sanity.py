"""What stands to reason of any evaluation, on a few real worlds of the full corpus."""

import dataclasses
import json

import pytest

from mpmworlds.baselines.evaluate import evaluate_examples
from mpmworlds.baselines.provenance import Provenance
from mpmworlds.baselines.registry import predictor_named
from mpmworlds.baselines.report.numbers import merged_rows
from mpmworlds.baselines.results import SUMMARY
from mpmworlds.baselines.system import System
from mpmworlds.builder.release.layout import RECORD
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.load import Example
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.metrics import anchored_score
from mpmworlds.metrics.reduction import reduce_clip, split_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scale import rescale
from tests.baselines.made_results import made_record

# Of one material each, with a motion that its numbers decide.
NAMES = ("s04", "s07", "s12")
ROWS = (
    ("oracle", "frames_only"),
    ("config_oracle", "full_config"),
    ("noise_ceiling", "frames_only"),
    ("config_oracle_typical_materials", "no_materials"),
    ("copy_last", "frames_only"),
    ("black", "frames_only"),
)


@pytest.fixture(scope="module")
def examples():
    seeds = {name.split("_")[0]: scene for name, scene in load_seeds().items()}
    found = []
    for name in NAMES:
        scene = rescale(seeds[name], 64, 128, 150)
        program, rate = link(scene), scene.output.framerate
        frames = run(program, trusted=True).expect()
        prefix, continuation = split_clip(reduce_clip(frames, rate), 15)
        row = {
            "id": name,
            "family_id": name,
            "materials": sorted(scene.materials),
            "object_types": sorted({o.object_type for o in scene.objects}),
            "num_objects": len(scene.objects),
            "motion": None,
            "ceiling": None,
            "scene": scene.to_yaml(),
            "program": program,
            "num_frames": 150,
            "framerate": rate,
            "resolution": 128,
        }
        found.append(Example(name, prefix, continuation, 15, row))
    return found


@pytest.fixture(scope="module")
def evaluated(examples, tmp_path_factory):
    """Folders of results by predictor."""
    folder = tmp_path_factory.mktemp("sanity")
    (folder / RECORD).write_text(made_record("seeds").text())
    found = {}
    for name, regime in ROWS:
        told = [dataclasses.replace(e, regime=REGIMES[regime]) for e in examples]
        predictor = predictor_named(name)
        where = Provenance.of(folder, predictor, "seeds", "train", regime)
        path = evaluate_examples(told, predictor, where, folder / name, progress=False)
        summary = json.loads(path.read_text())
        assert summary["outcomes"] == {"ok": len(NAMES)}, name
        found[name] = path.parent
    return found


@pytest.fixture(scope="module")
def means(evaluated):
    return {
        name: {
            metric: entry["failures_at_worst"]["mean"]
            for metric, entry in summary["continuation"].items()
        }
        for name, folder in evaluated.items()
        for summary in [json.loads(folder.joinpath(SUMMARY).read_text())]
    }


@pytest.fixture(scope="module")
def anchored(evaluated):
    rows = {name: merged_rows(System.read(path)) for name, path in evaluated.items()}
    ceilings = {row.sample_id: row.scores for row in rows["noise_ceiling"]}
    floor = rows["copy_last"]
    return {name: anchored_score(r, floor, ceilings).mean for name, r in rows.items()}


@pytest.mark.slow
def test_knowing_more_overlaps_more(means):
    overlap = [means[name]["mask_iou"] for name, _ in ROWS]
    oracle, config, ceiling, typical, _, black = overlap
    assert oracle == config == 1.0
    assert 1.0 >= ceiling > typical > black == 0.0


@pytest.mark.slow
def test_knowing_more_ranks_higher(anchored):
    assert anchored["oracle"] == anchored["config_oracle"]
    assert anchored["copy_last"] == 0.0
    assert anchored["noise_ceiling"] == 1.0
    order = [anchored[name] for name, _ in ROWS if name != "copy_last"]
    assert order[1] >= order[2] > order[3] > order[4]


@pytest.mark.slow
def test_the_truth_has_no_fault_and_nothing_has_every_one(means):
    assert means["oracle"] == means["config_oracle"]
    assert means["oracle"]["collapse_excess"] == means["oracle"]["anomaly"] == 0.0
    assert means["black"]["collapse"] == means["black"]["color_tv"] == 1.0
    assert means["copy_last"]["wmae"] == pytest.approx(1.0, abs=1e-6)
