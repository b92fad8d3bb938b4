"""Small examples and a release folder for the evaluation tests."""

import numpy as np
import pytest

from mpmworlds.baselines.provenance import Provenance
from mpmworlds.baselines.simple.copy_last import CopyLast
from mpmworlds.builder.release.layout import RECORD
from mpmworlds.loaders.load import Example
from tests.baselines.made_results import made_record

ROW = {
    "family_id": "p0001",
    "materials": ["liquid"],
    "object_types": ["emitter"],
    "num_objects": 1,
    "motion": 0.25,
    "ceiling": None,
    "num_materials": 1,
    "program": "",
    "num_frames": 16,
    "framerate": 15,
    "resolution": 32,
}


def moving_square(frames, speed=1, colour=(200, 40, 40)):
    clip = np.zeros((frames, 32, 32, 3), np.uint8)
    for t in range(frames):
        left = 2 + speed * t
        clip[t, 10:18, left : left + 8] = colour
    return clip


@pytest.fixture
def make_example():
    """Return a maker of examples: a square that moves right, 6 + 10 frames."""

    def make(sample_id="p0001", speed=1, **row):
        clip = moving_square(16, speed)
        return Example(
            id=sample_id,
            prefix=clip[:6],
            continuation=clip[6:],
            framerate=15,
            row=ROW | {"id": sample_id, "family_id": sample_id[:5]} | row,
        )

    return make


@pytest.fixture
def provenance(tmp_path):
    release = tmp_path / "release"
    release.mkdir()
    (release / RECORD).write_text(made_record("tiny").text())
    return Provenance.of(release, CopyLast(), "tiny", "test")
