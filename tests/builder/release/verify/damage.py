"""A small release, and what may be done to it."""

import hashlib
from pathlib import Path

import numpy as np
import pyarrow as pa

from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import (
    Batch,
    Record,
    index_bytes,
    index_path,
    read_record,
)
from mpmworlds.builder.release.verify import verify_release
from mpmworlds.files.checksums import write_checksums
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4, frames_sha256
from mpmworlds.sim.run.preview import encode_preview, poster
from mpmworlds.sim.scene.palette import PALETTE

SCENE = """
schema: mpmworlds-scene/1
simulation: {{grid_resolution: 32, time_step_dt: 1.0e-4, substeps_per_frame: 40,
             duration_frames: 4, particles_per_cell: 4, seed: 7}}
objects:
- name: object_0
  object_type: dynamic_body
  shape: {{type: box, center: [0.5, 0.5], size: [0.3, 0.3]}}
  physics_properties: {{constitutive_model: elastic, density: 1000.0,
                       youngs_modulus: 5.0e+4, poissons_ratio: 0.2}}
  initial_state: {{velocity: [4.0, 0.0]}}
  visualization: {{color: '{color}'}}
output: {{resolution: 64, framerate: 30}}
"""
SAMPLES = {
    "s00": ("train", PALETTE["red"]),
    "p0000": ("train", PALETTE["green"]),
    "p0001": ("test", PALETTE["sky"]),
}
CONFIGS = {"full": None, "full-clips": None, "preview": None}
TEST = "data/full/test-00000-of-00001.arrow"
TRAIN = [f"data/full/train-0000{number}-of-00002.arrow" for number in range(2)]
RECIPES = "data/recipes/test-00000-of-00001.arrow"


def findings_of(release, resimulate=0, **options):
    """Return the findings, one line each."""
    found = verify_release(release, resimulate=resimulate, **options)
    return [str(finding) for finding in found.findings]


def rows_of(path):
    with pa.OSFile(str(path), "rb") as file:
        return pa.ipc.open_stream(file).read_all().to_pylist()


def config_of(path):
    return Path(path).parent.name


def write_rows(path, rows, features=None):
    schema = (features or features_of(config_of(path))).arrow_schema
    with (
        pa.OSFile(str(path), "wb") as file,
        pa.ipc.new_stream(file, schema) as writer,
    ):
        writer.write_table(pa.Table.from_pylist(rows, schema=schema))


def batches_of(path):
    """Return where the record batches of a file lie."""
    found = []
    with pa.memory_map(str(path)) as source:
        schema = pa.ipc.read_schema(source)
        while True:
            start = source.tell()
            try:
                message = pa.ipc.read_message(source)
            except EOFError:
                return found
            rows, size = pa.ipc.read_record_batch(message, schema), source.tell()
            data = path.read_bytes()[start:size]
            ids = tuple(map(str, rows.column("id").to_pylist()))
            digest = hashlib.sha256(data).digest()
            found.append(Batch(start, size - start, digest, ids))


def fix_up(copy):
    """Make all say what the files of rows hold: record, indexes, card and checksums."""
    before = read_record(copy)
    configs = {}
    for name, config in before.configs.items():
        files = []
        for file in config.files:
            path = copy / file.path
            changes = {
                "size": path.stat().st_size,
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
                "rows": len(rows_of(path)),
            }
            files.append(file.model_copy(update=changes))
        parts = [(file, batches_of(copy / file.path)) for file in files]
        index = index_bytes(features_of(name).arrow_schema, parts)
        (copy / index_path(name)).write_bytes(index)
        configs[name] = config.model_copy(update={"files": files})
    record = before.model_copy(update={"configs": configs})
    (copy / "release.json").write_text(record.text())
    card = (copy / "README.md").read_text()
    for name in configs:
        card = card.replace(before.digest(name), record.digest(name))
    (copy / "README.md").write_text(card)
    write_checksums(copy)


def rewrite(copy, name, change):
    """Change the rows of a file and make everything else say the same again."""
    write_rows(copy / name, change(rows_of(copy / name)))
    fix_up(copy)


def changed(**values):
    return lambda rows: [row | values for row in rows]


def found(findings, name, text):
    """Whether a finding names a file, and says something."""
    return any(line.startswith(name) and text in line for line in findings)


def edited(copy, change):
    """Change the record, and make the checksums right again."""
    record = read_record(copy).model_dump()
    change(record)
    (copy / "release.json").write_text(Record(**record).text())
    write_checksums(copy)


def media(frames, rate=30):
    """Return the columns of a video, all of them in agreement."""
    clip = encode_mp4(reduce_clip(frames, rate), min(rate, 15))
    return {
        "video": {"bytes": encode_mp4(frames, rate), "path": "p0001.mp4"},
        "clip": {"bytes": clip, "path": "p0001.clip.mp4"},
        "frames_sha256": frames_sha256(frames),
        "num_frames": len(frames),
    }


def remade(change, *, only=("video", "clip", "frames_sha256"), rate=30):
    """Return a change of rows that changes their frames, and some of the columns."""

    def remake(rows):
        made = []
        for row in rows:
            columns = media(change(decode_mp4(row["video"]["bytes"])), rate)
            made.append(row | {name: columns[name] for name in only})
        return made

    return remake


def black(frames):
    return np.zeros_like(frames)


def same(frames):
    return frames


def backwards(frames):
    return frames[::-1]


def frames_everywhere(copy, change):
    """Put other frames into all videos of a sample, with all hashes right."""
    (row,) = rows_of(copy / TEST)
    frames = change(decode_mp4(row["video"]["bytes"]))
    reduced = reduce_clip(frames, 30)
    made = media(frames)
    made["preview"] = {
        "bytes": encode_preview(reduced, 15),
        "path": "p0001.preview.mp4",
    }
    made["poster"] = {"bytes": poster(reduced), "path": "p0001.png"}
    edit_everywhere(copy, made)


def edit_everywhere(copy, values):
    """Change columns of a sample wherever they are, with all hashes right."""
    for path in sorted(copy.glob("data/*/test-*.arrow")):
        columns = features_of(config_of(path))
        kept = {name: value for name, value in values.items() if name in columns}
        write_rows(path, changed(**kept)(rows_of(path)))
    fix_up(copy)
