"""A made-up corpus of real scenes: seeds, turned gravity, perturbations."""

import copy
from functools import cache

import numpy as np

from mpmworlds.builder.plan.manifest import ManifestRow, text_sha256
from mpmworlds.builder.recipes.perturb import perturb
from mpmworlds.builder.recipes.tables import first_tables
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits import SampleId, SplitParams, split_of
from mpmworlds.splits.audit_records import Record

# Chosen so that p0001 and p0003 are in test, p0000-c1 and p0004-c0 are modifications.
SPLIT = SplitParams("made-up-819", 0.4, 0.3)
ROOTS = ("p0000", "p0001", "p0002", "p0003", "p0004", "s05")
CHILDREN = 2
EDITS = {
    "seed": "",
    "parent": '{"operator": "compose"}',
    "child": '{"from": [0.0, -9.8], "operator": "change_gravity"}',
    "perturbation": '{"operator": "perturb"}',
}


def row_of(sample_id, text, seeds):
    """Return the manifest row of a scene."""
    sample, scene = SampleId.parse(sample_id), Scene.from_yaml(text, sample_id)
    materials = sorted(scene.materials)
    return ManifestRow(
        id=sample_id,
        kind=sample.kind,
        parent_id=sample.made_from,
        family_id=sample.family,
        seeds=seeds,
        edit=EDITS[sample.kind],
        split=split_of(sample_id, SPLIT),
        scene=text,
        materials=tuple(materials),
        object_types=tuple(sorted({thing.object_type for thing in scene.objects})),
        num_objects=len(scene.objects),
        num_materials=len(materials),
        motion=None,
        ceiling=None,
        scene_sha256=text_sha256(text),
        program_sha256=text_sha256(f"program of {text}"),
    )


def _text(data):
    return Scene.from_data(data).to_yaml()


@cache
def rows():
    """Rows of the corpus, a tuple: each template has one perturbation."""
    made = []
    scenes = list(load_seeds().items())
    for number, root in enumerate(ROOTS):
        name, scene = scenes[number]
        for child in (None, *range(CHILDREN)):
            data = copy.deepcopy(scene.to_data())
            if child is not None:
                data["environment"]["gravity"] = [2.0 + 2.0 * child, -7.0]
            template = str(SampleId(root, child))
            made.append(row_of(template, _text(data), (name,)))
            perturb(np.random.default_rng(number), first_tables(), data)
            made.append(row_of(f"{template}-n00", _text(data), (name,)))
    return tuple(sorted(made, key=lambda row: row.id))


def records(of=None):
    """Return what an audit reads of the corpus, or of other rows."""
    return [
        Record(*(getattr(row, name) for name in Record._fields))
        for row in (rows() if of is None else of)
    ]


def changed(sample_ids, **columns):
    """Return what an audit reads, with columns of some samples changed."""
    return [
        record._replace(**columns) if record.id in sample_ids else record
        for record in records()
    ]
